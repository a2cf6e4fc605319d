//! Chooses and edits the labels of a model, without a GPU.
//!
//! A [`Catalogue`] resolves ids and names, and [`choose()`] resolves points, boxes and masks in a view. [`extract`],
//! [`remove`], [`recolour`], [`relabel`], [`add()`], [`merge()`] and [`split_components`] return edited models;
//! [`fill()`] removes an object and closes the hole. [`clean()`] removes floaters, [`Simplifier`] reduces the number of
//! Gaussians, and [`Transform`] moves a model. [`carry()`] restores labels to a copy from another program,
//! [`summarise`] lists the labels, and [`strokes`] finds objects from lines over photos. An [`Edit`] is one change in
//! an editor; [`EditsFile`] lists all of them.

pub mod add;
pub mod carry;
pub mod catalogue;
pub mod change;
pub mod choose;
pub mod clean;
pub mod components;
pub mod edits;
pub mod fill;
pub mod merge;
pub mod nearest;
pub mod oriented_box;
pub mod prompt;
pub mod rename;
pub mod select;
pub mod selection;
pub mod simplify;
pub mod strokes;

pub use add::add;
pub use carry::{CarriedLabels, carry};
pub use catalogue::{Catalogue, Pick};
pub use change::{SmallParts, SplitLabels, recolour, relabel, split_components, without_specks};
pub use clean::{Cleaning, CleaningCounts, clean};
pub use components::Grouping;
pub use edits::{Document, Edit, EditsFile, Rows, Sights};
pub use fill::{Filled, Light, SIGHT_SIDE, Sight, fill};
pub use labelgs_formats::Transform;
pub use merge::{MergedLabels, merge};
pub use oriented_box::{Boxes, OrientedBox};
pub use prompt::{Prompt, PromptArea, choose};
pub use select::{LabelSummary, MIN_LABEL_CONFIDENCE, extract, remove, summarise};
pub use simplify::Simplifier;
