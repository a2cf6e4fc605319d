//! The finished training of a block.

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

/// Settings that a block decides, or that change no Gaussian.
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

/// A training that can be merged.
pub(super) struct TrainedBlock {
    pub block: BlockFile,
    pub folder: PathBuf,
    pub model: PathBuf,
    pub steps: u32,
    pub device: String,
    pub names: Option<LabelTable>,
    pub settings: Settings,
    /// New ids of its labels, where those of the trainings do not agree.
    pub ids: Option<BTreeMap<u32, u32>>,
    labelgs: String,
}

/// Why a training cannot be merged.
pub(super) struct Problem {
    pub text: String,
    /// There is no finished training, rather than a wrong one.
    pub is_missing: bool,
}

impl TrainedBlock {
    /// Reads the Gaussians of its core, with the new ids.
    pub(super) fn core(&self) -> crate::Result<Gaussians> {
        let mut model = core(&self.block, &self.model)?;
        if let (Some(ids), Some(labels)) = (&self.ids, &mut model.labels) {
            labels.iter_mut().for_each(|label| *label = ids.get(label).copied().unwrap_or(UNLABELLED));
        }
        Ok(model)
    }

    /// Looks at the folder of a training.
    pub(super) fn open(block: &BlockFile, folder: &Path) -> Result<Self, Problem> {
        let problem = |text: String, is_missing| Problem { text: format!("{}: {text}", folder.display()), is_missing };
        let missing = |what: &str| problem(format!("{what}; train block {} into it", block.id), true);
        let odd = |error: crate::Error| problem(error.to_string(), false);
        if !folder.join(block_file::BLOCK_FILE).is_file() {
            return Err(missing("no training of a block is there"));
        }
        if BlockFile::read(folder).map_err(odd)? != *block {
            let text = "was trained for another block or split; train it anew in an empty folder";
            return Err(problem(text.to_owned(), false));
        }
        let (metrics, config) = (folder.join(summary::METRICS_FILE), folder.join(run_folder::CONFIG));
        if !metrics.is_file() || !config.is_file() {
            return Err(missing("the training is not finished"));
        }
        let expected = "expected a file that a training wrote";
        let steps = read::json::<Value>(&metrics, expected).map_err(odd)?["steps"].as_u64().unwrap_or(0) as u32;
        let settings = Settings::read(&config).map_err(odd)?;
        if steps < settings.train.iterations {
            let text = format!("the training was stopped after {steps} of {} steps", settings.train.iterations);
            return Err(missing(&text));
        }
        let model = model_path(folder, steps);
        if !model.is_file() {
            return Err(missing(&format!("its model of step {steps} is gone")));
        }
        let run: Info = read::json(&folder.join(info::RUN_FILE), expected).map_err(odd)?;
        let last = run.parts.last().cloned().unwrap_or_default();
        Ok(Self {
            block: block.clone(),
            folder: folder.to_owned(),
            model,
            steps,
            device: last.device,
            names: LabelTable::of_folder(folder).map_err(odd)?,
            // The version alone: any commit of it may have written a part.
            labelgs: last.labelgs.split(' ').next().unwrap_or_default().to_owned(),
            settings,
            ids: None,
        })
    }
}

/// Returns the Gaussians of the model at `path` that are in the core of a block.
pub(super) fn core(block: &BlockFile, path: &Path) -> crate::Result<Gaussians> {
    let (model, core) = (models::open(path)?.gaussians, block.core.zone(block.axes));
    // Frozen rows come last; far ones of them may be in the core.
    let count = model.len().saturating_sub(block.frozen as usize);
    Ok(model.filtered(|row| row < count && core.contains(model.world(row))))
}

/// Returns in what trainings differ from the first that must be equal.
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
