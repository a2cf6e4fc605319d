//! The finished run of a block.

use crate::Setting;
use crate::files::label_table::LabelTable;
use crate::files::{read, run_folder};
use crate::records::block_file::{self, BlockFile};
use crate::run::info::{self, Info};
use crate::run::models::{self, model_path};
use crate::run::{Settings, summary};
use crate::scene::{Gaussians, UNLABELLED};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Settings that may differ between blocks: the block decides them, or they do not affect Gaussians.
const SETTINGS_THAT_MAY_DIFFER: [&str; 9] = [
    "seed",
    "iterations",
    "budget",
    "max_gaussians",
    "full_size_from",
    "save_at",
    "preview_every",
    "checkpoint_every",
    "photo_memory",
];

/// A block's run that can be merged.
pub(super) struct TrainedBlock {
    pub block: BlockFile,
    pub folder: PathBuf,
    pub model: PathBuf,
    pub steps: u32,
    pub device: String,
    pub names: Option<LabelTable>,
    pub settings: Settings,
    /// New label ids, if the runs' ids do not agree.
    pub ids: Option<BTreeMap<u32, u32>>,
    labelgs: String,
}

/// The reason why a run cannot be merged.
pub(super) struct Problem {
    pub text: String,
    /// The run is missing or unfinished, rather than wrong.
    pub is_missing: bool,
}

impl TrainedBlock {
    /// Reads the core's Gaussians, with the new ids.
    pub(super) fn core(&self) -> crate::Result<Gaussians> {
        let mut model = core(&self.block, &self.model)?;
        if let (Some(ids), Some(labels)) = (&self.ids, &mut model.labels) {
            labels.iter_mut().for_each(|label| *label = ids.get(label).copied().unwrap_or(UNLABELLED));
        }
        Ok(model)
    }

    /// Checks the folder of a run.
    pub(super) fn open(block: &BlockFile, folder: &Path) -> Result<Self, Problem> {
        let problem = |text: String, is_missing| Problem { text: format!("{}: {text}", folder.display()), is_missing };
        let missing = |what: &str| problem(format!("{what}; train block {} into it", block.id), true);
        let odd = |error: crate::Error| problem(error.to_string(), false);
        if !folder.join(block_file::BLOCK_FILE).is_file() {
            return Err(missing("no block was trained there"));
        }
        if BlockFile::read(folder).map_err(odd)? != *block {
            let text = "was trained for another block or split; train it again in an empty folder";
            return Err(problem(text.to_owned(), false));
        }
        let (metrics, config) = (folder.join(summary::METRICS_FILE), folder.join(run_folder::CONFIG_FILE));
        if !metrics.is_file() || !config.is_file() {
            return Err(missing("the run is not finished"));
        }
        let expected = "expected a file of a run";
        let steps = read::json::<Value>(&metrics, expected).map_err(odd)?["steps"].as_u64().unwrap_or(0) as u32;
        let settings = Settings::read(&config).map_err(odd)?;
        if steps < settings.train.iterations {
            let text = format!("the run stopped after {steps} of {} steps", settings.train.iterations);
            return Err(missing(&text));
        }
        let model = model_path(folder, steps);
        if !model.is_file() {
            return Err(missing(&format!("its model of step {steps} is missing")));
        }
        let run: Info = read::json(&folder.join(info::RUN_FILE), expected).map_err(odd)?;
        let last = run.parts.last().cloned().unwrap_or_default();
        Ok(Self {
            block: block.clone(),
            folder: folder.to_owned(),
            model,
            steps,
            device: last.device,
            names: LabelTable::read_in_folder(folder).map_err(odd)?,
            // Compare the version only: each part may come from another commit.
            labelgs: last.labelgs.split(' ').next().unwrap_or_default().to_owned(),
            settings,
            ids: None,
        })
    }
}

/// Reads the Gaussians of the model at `path` that are in a block's core.
pub(super) fn core(block: &BlockFile, path: &Path) -> crate::Result<Gaussians> {
    let (model, core) = (models::open(path)?.gaussians, block.core.zone(block.axes));
    // Frozen rows come last; far ones may lie in the core.
    let count = model.len().saturating_sub(block.frozen as usize);
    Ok(model.filtered(|row| row < count && core.contains(model.world(row))))
}

/// Lists the settings in which runs differ from the first run but must not.
pub(super) fn compare(trained: &[&TrainedBlock]) -> Vec<String> {
    let Some((first, others)) = trained.split_first() else { return Vec::new() };
    let mut problems = Vec::new();
    let wanted = first.settings.texts();
    for other in others {
        let own = other.settings.texts();
        let mut note = |what: &str, then: &str, now: &str| {
            let (here, there) = (other.folder.display(), first.folder.display());
            problems.push(format!("{here}: {what} is {now}, and {then} in {there}"));
        };
        if first.labelgs != other.labelgs {
            note("labelgs", &first.labelgs, &other.labelgs);
        }
        for key in Settings::keys().filter(|key| !SETTINGS_THAT_MAY_DIFFER.contains(&key.name)) {
            let value = |of: &BTreeMap<String, String>| of.get(key.name).map_or("not set", String::as_str).to_owned();
            let (then, now) = (value(&wanted), value(&own));
            if then != now {
                note(&Setting(key.name).to_string(), &then, &now);
            }
        }
    }
    problems
}
