//! Labels for a trained model from masks: votes of all views, and the paper's lift for comparison.

pub(crate) mod ballot;
pub(crate) mod decide;
pub(crate) mod lift;
pub(crate) mod model;
