//! Training: the loop over steps, and the work between steps.
//!
//! [`Trainer`] owns the model on the device. [`TrainConfig`] has every hyper-parameter; a [`Strategy`] changes the
//! number of Gaussians, [`Shared`] parameters belong to the scene or to a photo. [`crate::run`] adds files and scores.

mod alignment;
pub(crate) mod between;
mod context;
mod extension;
pub(crate) mod input;
pub(crate) mod objective;
mod refit;
mod report;
pub(crate) mod settings;
pub(crate) mod setup;
pub(crate) mod shared;
pub(crate) mod state;
pub(crate) mod strategy;
mod trainer;

pub use alignment::aligned;
pub(crate) use objective::Objective;
pub use refit::{REFIT_STEPS, refitted};
pub use report::{LabelWork, StepKind, StepReport};
pub use setup::first_model::first_model;
pub(crate) use setup::first_model::go_on_from;
pub(crate) use setup::{TrainerOptions, start_size};
pub(crate) use state::TrainState;
pub use strategy::Densified;
pub use settings::{ExposureMode, LabelRule, Occlusion, Preset, StrategyKind, TrainConfig};
pub(crate) use trainer::StepTimes;
pub use trainer::Trainer;
