//! A scene larger than a device: split into blocks, each trained on its own, and merged into one model.
//!
//! [`plan`] divides a coarse model of the whole scene so that each block fits the GPU memory, and chooses each block's
//! photos. [`split`] writes a folder per block. [`run::train`](crate::run::train) trains one block with
//! [`run::Request::block`](crate::run::Request::block), and [`merge`] joins the models. Blocks train independently, in
//! sequence or on several machines. [`guide::large_scenes`](crate::guide) shows it step by step.
//!
//! A block has a core, which the merged model takes from it, and a zone around the core, in which it grows Gaussians.
//! The cores are half-open boxes that cover space without overlap. Gaussians outside of the zone that its photos show
//! are included as frozen Gaussians of the coarse model.

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
