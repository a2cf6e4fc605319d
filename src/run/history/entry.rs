//! The entries of a history.

use crate::train::StepReport;
use serde::{Deserialize, Serialize};

/// An entry: one line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(crate) enum Entry {
    /// Means over some steps.
    Steps(Steps),
    /// A densification.
    Densified {
        /// Step after which it happened.
        step: u32,
        /// Gaussians cloned.
        cloned: u32,
        /// Gaussians split.
        split: u32,
        /// Gaussians removed.
        pruned: u32,
    },
    /// Scores of one view, in its preview.
    Preview(ViewScore),
    /// Mean scores of the held-out views at the end of the run.
    Scores(ViewScore),
    /// A warning.
    Warning {
        /// Steps done.
        step: u32,
        /// Text of the warning.
        text: String,
    },
}

/// Means over the steps since the previous entry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Steps {
    /// Last step.
    pub step: u32,
    /// Photo loss.
    pub loss: f64,
    /// Largest photo loss of a step.
    pub loss_max: f64,
    /// Mean absolute difference of colours.
    pub l1: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// Weighted label loss.
    pub label_loss: f64,
    /// Gaussians after the last step.
    pub gaussians: u32,
    /// Time of a step, ms.
    pub ms: f64,
    /// Training time until then, s.
    pub seconds: f64,
}

/// Scores of one or more views. A value that is not finite is absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ViewScore {
    /// Steps done.
    pub step: u32,
    /// Name of the view, for a single view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// PSNR, dB.
    pub psnr: Option<f64>,
    /// SSIM.
    pub ssim: Option<f64>,
    /// Mean IoU of the label map.
    pub iou: Option<f64>,
}

impl Entry {
    /// Returns the number of steps done.
    pub(crate) fn step(&self) -> u32 {
        match self {
            Self::Steps(steps) => steps.step,
            Self::Preview(scored) | Self::Scores(scored) => scored.step,
            Self::Densified { step, .. } | Self::Warning { step, .. } => *step,
        }
    }

    /// Returns true for entries that are written at the end of a run.
    pub(super) fn is_of_end(&self) -> bool {
        matches!(self, Self::Preview(_) | Self::Scores(_))
    }

    /// Returns the scores of a preview.
    pub(crate) fn preview(&self) -> Option<&ViewScore> {
        if let Self::Preview(scored) = self { Some(scored) } else { None }
    }

    /// Returns the scores of the end.
    pub(crate) fn scores(&self) -> Option<&ViewScore> {
        if let Self::Scores(scored) = self { Some(scored) } else { None }
    }

    /// Returns the means of an entry about steps.
    pub(crate) fn steps(&self) -> Option<&Steps> {
        if let Self::Steps(steps) = self { Some(steps) } else { None }
    }
}

/// Sums over the steps of an unfinished entry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Sums {
    steps: u32,
    loss: f64,
    loss_max: f64,
    l1: f64,
    ssim: f64,
    label_loss: f64,
}

impl Sums {
    pub(super) fn add(&mut self, report: &StepReport) {
        self.steps += 1;
        self.loss += report.loss;
        self.loss_max = self.loss_max.max(report.loss);
        self.l1 += report.l1;
        self.ssim += report.ssim;
        self.label_loss += report.label_loss;
    }

    /// Fills the means into an entry.
    pub(super) fn into_line(self, rest: Steps) -> Steps {
        let [loss, l1, ssim, label_loss] =
            [self.loss, self.l1, self.ssim, self.label_loss].map(|sum| sum / f64::from(self.steps.max(1)));
        Steps { loss, loss_max: self.loss_max, l1, ssim, label_loss, ..rest }
    }
}
