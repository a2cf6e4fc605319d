//! Training: the loop over steps, and the jobs between steps.
//!
//! [`run::train`](crate::run::train()) trains a folder of photos. This module is for changing the training itself. A
//! [`Trainer`] is a model in training; [`TrainConfig`] has every hyper-parameter, [`TrainerOptions`] the customisation
//! points below.
//!
//! | to change | set or implement | example |
//! | --- | --- | --- |
//! | what is trained, by which losses | [`Objective`] | |
//! | how Gaussians are added and removed | [`Strategy`], by a [`Population`] | `tools/examples/strategy.rs` |
//! | passes of a step | [`Extension`], at a [`Hook`] | `tools/examples/strategy.rs` |
//! | parameters of the scene or of photos | [`SharedParameters`] | `tools/examples/shared.rs` |
//!
//! The files, in the order of a training: `settings` and `objective`; `setup` with the first model; `trainer`, the
//! loop, with `context`, the state that steps use; `input`, photos and masks of a step; `strategy` and `shared`;
//! `between`, the jobs between steps; `report` and `state`. `refit` and `alignment` are separate trainings.

pub mod alignment;
pub(crate) mod between;
mod context;
mod extension;
pub mod input;
pub(crate) mod objective;
pub mod refit;
mod report;
pub(crate) mod settings;
pub mod setup;
pub mod shared;
pub mod state;
pub mod strategy;
mod trainer;

pub use crate::pass::{Builder, Extension, Hook};
pub use crate::scheduler::plan::Buf;
pub use crate::shaders::structs::StepUniforms;
pub use objective::{Loss, Objective, Parameter};
pub use report::{LabelWork, StepKind, StepReport};
pub use settings::{ExposureMode, LabelRule, Moments, Occlusion, Preset, StrategyKind, TrainConfig};
pub use setup::TrainerOptions;
pub use setup::first_model::first_model;
pub use shared::exposure::Exposure;
pub use shared::poses::Poses;
pub use shared::{RowOffsets, SharedLayout, SharedParameters, SharedSet};
pub use state::TrainState;
pub use strategy::{DensifyCounts, Population, StepContext, Strategy};
pub use trainer::{PendingState, Trainer};

pub use alignment::aligned;
pub use refit::{REFIT_STEPS, refitted};
pub(crate) use setup::first_model::go_on_from;
pub(crate) use setup::start_size;
pub(crate) use trainer::StepTimes;
