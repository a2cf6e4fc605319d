//! Reads the files of a run that a report needs.

use crate::error::{Error, Result};
use crate::files::{read, run_folder};
use crate::run::history::{self, Entry, Steps};
use crate::run::info::{self, Info};
use crate::run::passes::Pass;
use crate::run::{ObjectSummary, Settings, summary};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Optional file with pass times, written by the user.
const PROFILE_FILE: &str = "profile.json";

/// A run.
pub(super) struct ReportedRun {
    pub name: String,
    pub folder: PathBuf,
    pub settings: Settings,
    pub info: Info,
    pub history: Vec<Entry>,
    /// `None` unless the run has ended.
    pub metrics: Option<Metrics>,
    pub profile: Option<Profile>,
}

/// `metrics.json`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Metrics {
    pub steps: u32,
    pub gaussians: u32,
    pub objects: Vec<ObjectSummary>,
    pub test: Option<TestScores>,
}

/// Mean scores of the held-out views.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TestScores {
    pub psnr: Option<f64>,
    pub ssim: Option<f64>,
    pub iou_map: Option<f64>,
    pub iou_object: Option<f64>,
}

/// Stage times of a step.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Profile {
    pub device: String,
    pub gaussians: u32,
    pub passes: Vec<Pass>,
}

/// Reads a JSON file; `None` if it does not exist.
pub(crate) fn json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    const EXPECTED: &str = "this is not a valid training record; fix or delete it";
    if path.is_file() { read::json(path, EXPECTED).map(Some) } else { Ok(None) }
}

impl ReportedRun {
    /// Reads the files in a run folder. All except `config.toml` may be missing, because an interrupted run lacks some.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "is not a folder; name the output folder of a run"));
        }
        let Some(settings) = Settings::for_model(folder)? else {
            let problem = format!("has no {}; name the output folder of a run", run_folder::CONFIG_FILE);
            return Err(Error::data(folder, "", problem));
        };
        let path = folder.join(history::HISTORY_FILE);
        let history = if path.is_file() { history::read(&path)?.entries } else { Vec::new() };
        let info = Info::read(&folder.join(info::RUN_FILE))?.unwrap_or_default();
        // If the run has not ended, the file belongs to another run in this folder.
        let metrics = if info.ended.is_some() { json(&folder.join(summary::METRICS_FILE))? } else { None };
        let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let name = whole.file_name().map_or_else(|| whole.display().to_string(), |name| name.to_string_lossy().into());
        let profile = json(&folder.join(PROFILE_FILE))?;
        Ok(Self { name, folder: folder.to_owned(), settings, info, history, metrics, profile })
    }

    /// Returns the mean scores.
    pub(super) fn test(&self) -> Option<&TestScores> {
        self.metrics.as_ref()?.test.as_ref()
    }

    /// Returns the training time until its end or its last history line, s.
    pub(super) fn seconds(&self) -> Option<f64> {
        self.info.ended.map(|ended| ended.seconds).or(self.last().map(|steps| steps.seconds))
    }

    /// Returns the steps done.
    pub(super) fn steps(&self) -> u32 {
        let last = self.history.last().map_or(0, Entry::step);
        self.metrics.as_ref().map_or(last, |metrics| metrics.steps)
    }

    /// Returns the number of Gaussians.
    pub(super) fn gaussians(&self) -> Option<u64> {
        let last = self.last().map(|steps| steps.gaussians);
        self.metrics.as_ref().map(|metrics| metrics.gaussians).or(last).map(u64::from)
    }

    /// Returns the last history entry about steps.
    fn last(&self) -> Option<&Steps> {
        self.history.iter().rev().find_map(Entry::steps)
    }
}

/// Replaces duplicate run names by folder paths.
pub(super) fn tell_apart(runs: &mut [ReportedRun]) {
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    for run in runs {
        if names.iter().filter(|name| **name == run.name).count() > 1 {
            run.name = run.folder.display().to_string();
        }
    }
}
