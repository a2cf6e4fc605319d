//! Choice and change of the labels of a model.

pub(crate) mod catalogue;
pub(crate) mod change;
pub(crate) mod choose;
pub(crate) mod components;
pub(crate) mod prompt;
pub(crate) mod rename;
pub(crate) mod select;

pub use catalogue::{Catalogue, Pick};
pub use change::{Specks, Split, recolour, relabel, split_components, without_specks};
pub use components::Grouping;
pub use prompt::{Place, Prompt, choose};
pub use select::{LabelSummary, MIN_LABEL_CONFIDENCE, extract, remove, summarise};
