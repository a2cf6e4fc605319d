//! Sets of settings: presets, the 3DGS schedule, the paper.

use crate::scene::Gaussians;
use crate::train::{ExposureMode, LabelRule, StrategyKind, TrainConfig};

/// Length and quality of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Preset {
    /// 2000 steps: a first look.
    Draft,
    /// 7000 steps, the default.
    Standard,
    /// 30000 steps and up to twice as many Gaussians.
    Best,
    /// The settings of the LabelGS paper, where the default differs.
    Paper,
}

impl TrainConfig {
    /// Returns the settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        let (iterations, detail) = match preset {
            Preset::Draft => (2000, 0.5),
            Preset::Standard => (7000, 0.5),
            Preset::Best => (30_000, 1.0),
            Preset::Paper => return Self::paper(),
        };
        Self { iterations, detail, ..Self::default() }
    }

    /// Returns the settings of the paper where they differ from the default.
    pub fn paper() -> Self {
        Self {
            label_rule: LabelRule::Main,
            label_weight: 1.0,
            label_alpha: 0.0,
            densify_until: Some(40_000),
            opacity_reset_interval: 3000,
            ..Self::adc()
        }
    }

    /// Returns the settings for trainings that use a finished model, with near plane `near`.
    pub(in crate::train) fn for_finished(model: &Gaussians, near: f32) -> Self {
        Self {
            near,
            sh_degree: model.sh_degree,
            sh_degree_interval: Some(1),
            antialias: model.antialiased,
            exposure: ExposureMode::Off,
            free_space: false,
            ..Self::default()
        }
    }

    /// Returns the 3DGS schedule and rates, in absolute steps.
    pub fn adc() -> Self {
        Self {
            iterations: 15_000,
            strategy: StrategyKind::Adc,
            exposure: ExposureMode::Off,
            depth_weight: Some(0.0),
            layer_every: Some(1),
            start_size: Some(1.0),
            free_space: false,
            far_points: 0,
            full_size_from: Some(0),
            label_from: Some(1000),
            vote_every: Some(500),
            occlusion_every: Some(1000),
            sh_degree_interval: Some(1000),
            rate_factor: Some(1.0),
            rate_final: 1.0,
            densify_from: Some(500),
            densify_interval: Some(100),
            ..Self::default()
        }
    }
}
