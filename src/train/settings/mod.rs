//! The settings of a training, and what they say about a step.

mod choices;
mod config;
mod presets;
mod schedule;

pub use choices::{ExposureMode, LabelRule, Moments, Occlusion, StrategyKind};
pub use config::TrainConfig;
pub use presets::Preset;
