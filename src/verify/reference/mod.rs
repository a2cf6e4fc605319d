//! The method in f64, written from its equations: one function per pass, under the name of the pass.
//!
//! Nothing here is shaped like a kernel. Rules (every constant) are an argument, so that a mutant can change one.
//! Each function that decides something also returns a *margin*: how far the nearest decision was from going the other
//! way, as a fraction of the threshold (for the exponent of alpha: in units of log2, an absolute distance).

pub mod adam;
pub mod blend;
pub mod densify;
pub mod lift;
pub mod loss;
pub mod model;
pub mod project;
pub mod random;
pub mod rules;
pub mod scan;
pub mod sh;
pub mod sort;
pub mod splat;
pub mod step;
pub mod tile;

pub use model::{Group, Model, Row};
pub use rules::Rules;
