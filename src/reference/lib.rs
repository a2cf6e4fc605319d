//! The method in f64, written from its equations: one function per pass, with the name of the pass.
//!
//! The code does not imitate the kernels. The rules (all constants) are an argument, so that mutation tests can change
//! one. Every function with decisions also returns a *margin*: the distance of the nearest decision to its opposite, as
//! a fraction of the threshold (for the exponent of alpha: an absolute distance in units of log2).

pub mod adam;
pub mod blend;
pub mod densify;
pub mod disagreement;
pub mod exposure;
pub mod finite;
pub mod lazy;
pub mod lift;
pub mod loss;
pub mod model;
pub mod moments;
pub mod pose;
pub mod project;
pub mod random;
pub mod relocate;
pub mod rules;
pub mod scan;
pub mod sh;
pub mod smooth;
pub mod sort;
pub mod splat;
pub mod step;
pub mod tile;

pub use model::{Group, Model, Row};
pub use rules::Rules;
