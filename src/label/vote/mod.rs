//! Labels a trained model from masks: votes of all views, and the paper's lifting for comparison.

pub mod ballot;
pub mod decide;
pub(crate) mod lift;
pub(crate) mod model;
