//! The report of a step: its work and losses.

use crate::engine::Report;
use crate::train::TrainConfig;
use crate::train::input::step_input::{self, StepInput, StepView};

/// The results of a finished step.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Step, from 1.
    pub step: u32,
    /// Photo loss: (1 - lambda) L1 + lambda (1 - SSIM).
    pub loss: f64,
    /// Mean absolute difference of colours.
    pub l1: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// Weighted label loss.
    pub label_loss: f64,
    /// Work of the step.
    pub kind: StepKind,
    /// Counters of the device.
    pub report: Report,
}

impl StepReport {
    pub(super) fn new(input: &StepInput, view: StepView, config: &TrainConfig, report: Report) -> Self {
        let scale = 1.0 / (3.0 * view.valid_pixels.max(1) as f64);
        let (counters, lambda) = (&report.counters, f64::from(step_input::LAMBDA_DSSIM));
        let l1 = f64::from(counters.loss_l1) * scale;
        let ssim = f64::from(counters.loss_ssim) * scale;
        let loss = (1.0 - lambda) * l1 + lambda * (1.0 - ssim);
        let label_loss = step_input::label_loss(input, view, config, counters.loss_label);
        let kind = StepKind::new(input, &view, config);
        Self { step: input.step, loss, l1, ssim, label_loss, kind, report }
    }
}

/// Label work of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelWork {
    /// None: before labels start, between two steps with labels, or without masks.
    #[default]
    None,
    /// Label disagreement, in the scene's blend pass.
    Disagreement,
    /// Object layers of sampled objects.
    Layers,
}

/// The properties of a step that determine its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepKind {
    /// Width and height of its photo, px.
    pub size: (u32, u32),
    /// Degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Label work.
    pub labels: LabelWork,
}

impl StepKind {
    fn new(input: &StepInput, view: &StepView, config: &TrainConfig) -> Self {
        let labels = match (input.layers.is_empty(), input.labels) {
            (false, _) => LabelWork::Layers,
            (true, true) => LabelWork::Disagreement,
            (true, false) => LabelWork::None,
        };
        let size = (view.camera.width, view.camera.height);
        Self { size, sh_degree: config.sh_degree_at(input.step), labels }
    }
}
