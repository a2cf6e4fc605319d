//! What came of a run: for the caller, and `metrics.json`.

use crate::error::Result;
use crate::eval::scores::Scores;
use crate::io::atomic;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Name of the file in the folder of a run.
const FILE: &str = "metrics.json";

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Steps done.
    pub steps: u32,
    /// Time of the training without reading and scoring, s.
    pub seconds: f64,
    /// Gaussians of the model.
    pub gaussians: u32,
    /// Photo loss of the last step; none if no step was done.
    pub loss: Option<f64>,
    /// Its label loss, weighted.
    pub label_loss: Option<f64>,
    /// The model.
    pub model: PathBuf,
    /// Scores of the held-out views; none without such views, and of a run that was stopped.
    pub scores: Option<Scores>,
    /// The observer stopped the run; the model and, where steps are left, a checkpoint are written.
    pub stopped: bool,
}

impl Summary {
    /// The content of `metrics.json`.
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "schema_version": 1,
            "steps": self.steps,
            "seconds": self.seconds,
            "gaussians": self.gaussians,
            "loss": self.loss,
            "label_loss": self.label_loss,
            "model": self.model.display().to_string(),
            "test": self.scores.as_ref().map(|scores| &scores.mean),
            "views": self.scores.as_ref().map(|scores| &scores.views),
        })
    }

    /// Writes `metrics.json` into the folder of the run.
    pub(super) fn write(&self, out: &Path) -> Result<()> {
        atomic::write_json(&out.join(FILE), &self.to_json())
    }
}
