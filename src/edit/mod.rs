//! Chooses and changes the labels of a model, without a device.
//!
//! A [`Catalogue`] resolves ids and names, and [`choose`] resolves points, boxes and masks in a view. [`extract`],
//! [`remove`], [`recolour`], [`relabel`], [`merge()`] and [`split_components`] return changed models; [`fill()`] removes
//! and closes the hole; [`clean()`] drops what disturbs, [`Simplifier`] makes fewer of many, [`Transform`]
//! moves a model; [`summarise`] lists the labels.

pub(crate) mod catalogue;
pub(crate) mod change;
pub(crate) mod choose;
pub(crate) mod clean;
pub(crate) mod components;
pub(crate) mod fill;
pub(crate) mod merge;
pub(crate) mod prompt;
pub(crate) mod rename;
pub(crate) mod select;
pub(crate) mod simplify;

pub use crate::formats::Transform;
pub use catalogue::{Catalogue, Pick};
pub use change::{Specks, Split, recolour, relabel, split_components, without_specks};
pub use clean::{Cleaned, Cleaning, clean};
pub use components::Grouping;
pub use fill::{Filled, Light, SIGHT_SIDE, Sight, fill};
pub use merge::{Merged, merge};
pub use prompt::{Place, Prompt, choose};
pub use select::{LabelSummary, MIN_LABEL_CONFIDENCE, extract, remove, summarise};
pub use simplify::Simplifier;
