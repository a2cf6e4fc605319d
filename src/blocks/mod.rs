//! A scene larger than a device: split into blocks, each trained on its own, and merged into one model.
//!
//! [`plan`] divides a coarse model of the whole scene by the memory of a card, and chooses the photos of each block;
//! [`split`] writes a folder for each. [`run::train`](crate::run::train) trains one of them at a time, anywhere, with
//! [`run::Request::block`](crate::run::Request::block), and [`merge`] joins the models. Nothing of it needs another
//! block to be there: files in, files out. [`guide::large_scenes`](crate::guide) shows it step by step.
//!
//! A block has a core, which the merged model takes from it, and a zone around the core, in which it grows Gaussians.
//! The cores are half-open boxes that cover space without overlap. What its photos show beside the zone is there too, as
//! frozen Gaussians of the coarse model.

mod cells;
mod choose;
mod coarse;
mod estimate;
mod frame;
mod join;
mod merge;
mod need;
mod plan;
mod seams;
mod split;
mod trained;

pub use crate::records::block_file::{BlockRow, Bounds};
pub use estimate::{Estimate, PlannedScene, estimate};
pub use join::BlockMasks;
pub use merge::{MergeOptions, MergeResult, merge};
pub use need::BlockNeed;
pub use plan::{Plan, PlanOptions, plan};
pub use seams::Seams;
pub use split::split;
