//! Labels of Gaussians from masks.
//!
//! [`label_by_votes`] labels a trained model by the votes of all views, [`label_by_lift`] by the rule of the paper.
//! [`strokes`] finds the Gaussians that strokes over photos hit. [`occlusion`] finds which objects hide which, and
//! [`masks`] makes the masks of different views agree.

#[cfg(feature = "network")]
pub mod click;
pub mod masks;
pub mod occlusion;
pub mod strokes;
pub mod vote;

pub use vote::decide::Decision;
pub use vote::model::{VoteOptions, columns_of, label_by_lift, label_by_votes, vote_engine};
