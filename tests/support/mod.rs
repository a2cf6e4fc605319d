//! Helpers of the tests: predicates and scenes.

pub mod compare;
pub mod scenes;
