//! Labels of Gaussians from masks: votes over all views, what hides what, and masks made to agree with each other.

pub mod masks;
pub mod occlusion;
pub(crate) mod vote;

pub use vote::decide::Decision;
pub use vote::lift::Lift;
pub use vote::model::{Counting, columns_of, label_by_lift, label_by_votes, vote_engine};
