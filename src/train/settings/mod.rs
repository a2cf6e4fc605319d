//! Training settings, and their values per step.

mod choices;
mod config;
mod presets;
mod schedule;

pub use choices::{ExposureMode, LabelRule, Moments, Occlusion, StrategyKind};
pub use config::TrainConfig;
pub use presets::Preset;
