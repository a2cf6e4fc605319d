//! Inputs of a step: a view or a part of it, with photo, masks and known depths.

pub(in crate::train) mod backdrop;
pub(in crate::train) mod free_space;
pub(crate) mod known_depths;
pub(in crate::train) mod part;
pub(in crate::train) mod prefetch;
pub(in crate::train) mod sampler;
pub mod step_input;
pub(in crate::train) mod views;
