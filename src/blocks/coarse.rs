//! The coarse model of a scene, from which all blocks start.

use super::frame::Frame;
use crate::error::{Error, Result};
use crate::files::label_table::LabelTable;
use crate::files::{read, run_folder};
use crate::run::{Settings, latest_model, models, summary};
use crate::scene::{ColourMatrix, Dataset, Gaussians};
use crate::scenes::{LoadOptions, Lookup};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A scene with its coarse model.
pub(super) struct CoarseModel {
    pub dataset: Dataset,
    pub model: Gaussians,
    /// Rows of the near Gaussians, ascending.
    pub near_rows: Vec<usize>,
    /// CRC-32 of the model file.
    pub crc: u32,
    /// Near plane, world units.
    pub near: f32,
    /// Settings that the model was trained with.
    pub settings: Settings,
    /// Label names.
    pub names: Option<LabelTable>,
    /// Exposure matrix of each photo, if exposures were trained.
    pub exposures: BTreeMap<String, ColourMatrix>,
    /// Seconds per training step, if known.
    pub pace: Option<f64>,
}

impl CoarseModel {
    /// Reads the cameras of a scene and its coarse model: the folder of a finished run.
    pub(super) fn open(scene: &Path, model: &Path, options: LoadOptions) -> Result<Self> {
        let path = latest_model(model)?;
        let Some(settings) = Settings::for_model(&path)? else {
            let problem = "has no config.toml; name the output folder of a finished run";
            return Err(Error::data(model, "", problem));
        };
        let metrics: Value =
            read::json(&model.join(summary::METRICS_FILE), "expected the output folder of a finished run")?;
        let (seconds, steps) = (metrics["seconds"].as_f64(), metrics["steps"].as_f64().unwrap_or(0.0));
        let options = LoadOptions {
            max_resolution: (settings.read.max_resolution > 0).then_some(settings.read.max_resolution),
            test_every: (settings.read.test_every > 0).then_some(settings.read.test_every),
            photos: false,
            lookup: Lookup { poses: settings.read.poses, ..options.lookup },
            ..options
        };
        let dataset = crate::scenes::open_logged(scene, &options)?;
        let found = models::open(&path)?.gaussians;
        if found.is_empty() || dataset.train.is_empty() {
            return Err(Error::data(&path, "", "the model has no Gaussians, or the scene has no training views"));
        }
        Ok(Self {
            dataset,
            near_rows: Vec::new(),
            crc: crc32fast::hash(&read::bytes(&path)?),
            near: settings.train.near,
            names: LabelTable::find_for_model(&path).map(|table| LabelTable::read(&table)).transpose()?,
            exposures: exposures(model)?,
            pace: seconds.filter(|_| steps > 0.0).map(|seconds| seconds / steps),
            model: found,
            settings,
        })
    }

    /// Finds the near rows, keeps them, and returns them with their positions.
    pub(super) fn settle(&mut self, frame: &Frame) -> Vec<(usize, glam::DVec3)> {
        let near = frame.near_gaussians(&self.model);
        self.near_rows = near.iter().map(|(row, _)| *row).collect();
        near
    }

    pub(super) fn max_label(&self) -> Option<u32> {
        self.model.labels.as_ref().map(|labels| labels.iter().copied().max().unwrap_or(0).max(1))
    }
}

fn exposures(folder: &Path) -> Result<BTreeMap<String, ColourMatrix>> {
    let path: PathBuf = folder.join(run_folder::EXPOSURES_FILE);
    if !path.is_file() {
        return Ok(BTreeMap::new());
    }
    let file: Value = read::json(&path, "expected the exposures of a run")?;
    serde_json::from_value(file["matrices"].clone()).map_err(|error| {
        let problem = format!("exposures of another labelgs version ({error}); train the coarse model again");
        Error::data(&path, "matrices", problem)
    })
}
