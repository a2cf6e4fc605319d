//! Every pass on the device against its mirror in f64. Each comparison is repeated with every relevant constant
//! changed, and must fail then.
//!
//! A mirror gets the inputs of the device's pass (downloaded, widened to f64), so tolerances measure one pass at a
//! time; `step` compares the whole chain. Tolerances are 1.5 times the largest error on lavapipe, which is written
//! beside them.

mod antialias;
mod bands;
mod blend;
mod depth_prior;
mod disagreement;
mod finite;
pub mod fixture;
mod group_blend;
mod label_map;
mod labels;
mod loss;
mod moments;
mod optimize;
mod orders;
mod project;
mod relocate;
mod step;
mod sweeps;
mod tile;
mod update;
mod votes;
mod walks;
