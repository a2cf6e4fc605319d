//! Every pass on the device against its mirror in f64, each comparison repeated with every constant that bears on it
//! changed: then it must fail.
//!
//! A mirror gets what the device's pass got (downloaded, widened to f64), so that tolerances measure one pass at a time;
//! `step` compares the whole chain. Tolerances are 1.5 times the worst value seen on lavapipe, written beside them.

mod blend;
pub mod fixture;
mod labels;
mod loss;
mod optimize;
mod orders;
mod project;
mod separate;
mod step;
mod tile;
mod votes;
