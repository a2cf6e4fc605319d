//! The result of a run, for the caller and in `metrics.json`.

use super::ObjectSummary;
use crate::error::Result;
use crate::eval::scores::Scores;
use crate::files::atomic;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Name of the file.
pub(crate) const METRICS_FILE: &str = "metrics.json";

/// The result of a run.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Number of finished steps.
    pub steps: u32,
    /// Training time without reading and scoring, including earlier parts of an interrupted run, s.
    pub seconds: f64,
    /// Number of Gaussians in the model.
    pub gaussians: u32,
    /// Photo loss of the last step; `None` if the run had no steps.
    pub loss: Option<f64>,
    /// Weighted label loss of the last step.
    pub label_loss: Option<f64>,
    /// Path of the model.
    pub model: PathBuf,
    /// Scores of the held-out views; `None` without such views and in a stopped run.
    pub scores: Option<Scores>,
    /// The objects of the model, by id; empty without masks.
    pub objects: Vec<ObjectSummary>,
    /// True if the observer stopped the run. The model is written, and a checkpoint if steps remain.
    pub stopped: bool,
}

impl Summary {
    /// Returns the content of `metrics.json`.
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "schema_version": 1,
            "steps": self.steps,
            "seconds": self.seconds,
            "gaussians": self.gaussians,
            "loss": self.loss,
            "label_loss": self.label_loss,
            "model": self.model.display().to_string(),
            "objects": self.objects,
            "test": self.scores.as_ref().map(|scores| &scores.mean),
            "views": self.scores.as_ref().map(|scores| &scores.views),
        })
    }

    /// Writes `metrics.json` into the run folder.
    pub(super) fn write(&self, out: &Path) -> Result<()> {
        atomic::write_json(&out.join(METRICS_FILE), &self.to_json())
    }
}
