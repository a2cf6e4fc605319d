//! Labels for a trained model from masks: votes of all views, and the lift of the paper for comparison.

pub mod ballot;
pub mod decide;
pub(crate) mod lift;
pub(crate) mod model;
