//! Labels of Gaussians from masks: votes over all views, what hides what, and masks made to agree with each other.

pub mod masks;
pub mod occlusion;
pub mod vote;
