//! Labels for a trained model from masks: votes of all views, and the paper's lift for comparison.

pub mod ballot;
pub mod decide;
pub mod lift;
pub mod model;
