//! Choice and change of the labels of a model.

pub mod catalogue;
pub mod change;
pub mod choose;
pub mod components;
pub mod prompt;
pub mod rename;
pub mod select;
