//! Chooses and changes the labels of a model, without a device.
//!
//! A [`Catalogue`] resolves ids and names, and [`choose()`] resolves points, boxes and masks in a view. [`extract`],
//! [`remove`], [`recolour`], [`relabel`], [`add()`], [`merge()`] and [`split_components`] return changed models; [`fill()`] removes
//! and closes the hole; [`clean()`] drops what disturbs, [`Simplifier`] makes fewer of many, [`Transform`]
//! moves a model; [`carry()`] gives labels back to a copy from another program; [`summarise`] lists the labels; [`strokes`] finds
//! objects by lines over photos. An [`Edit`] is one change of an editor, [`EditsFile`] all of them.

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
pub use carry::{Carried, carry};
pub use catalogue::{Catalogue, Pick};
pub use change::{Specks, Split, recolour, relabel, split_components, without_specks};
pub use clean::{Cleaned, Cleaning, clean};
pub use components::Grouping;
pub use edits::{Document, Edit, EditsFile, Rows, Sights};
pub use fill::{Filled, Light, SIGHT_SIDE, Sight, fill};
pub use labelgs_formats::Transform;
pub use merge::{Merged, merge};
pub use oriented_box::{Boxes, OrientedBox};
pub use prompt::{Place, Prompt, choose};
pub use select::{LabelSummary, MIN_LABEL_CONFIDENCE, extract, remove, summarise};
pub use simplify::Simplifier;
