//! Finds the checkpoint and the settings that a run resumes from.

use super::history::Sums;
use super::{Inputs, Request, ResumeSettings, Settings};
use crate::error::{Error, Result, Setting};
use crate::records::checkpoint_folder;
use crate::run::RunOptions;
use crate::scenes::ReadOptions;
use crate::train::TrainState;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The run's part of a checkpoint, besides the training state.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct RunState {
    pub inputs: Inputs,
    /// Source of the occluders at the start.
    pub occlusion: Option<String>,
    pub read: ReadOptions,
    pub run: RunOptions,
    /// Sums of the unfinished history line.
    #[serde(default)]
    pub history: Sums,
}

impl RunState {
    /// Reads the run's part of a checkpoint.
    pub(super) fn from_state(state: &TrainState) -> Result<Self> {
        serde_json::from_value(state.run.clone())
            .map_err(|error| Error::data(&state.path, "contents", format!("of the run: {error}")))
    }
}

/// A checkpoint to resume from.
pub(super) struct ResumePoint {
    pub state: TrainState,
    pub settings: Settings,
    pub record: RunState,
}

/// Returns the newest intact checkpoint in the folder, with the settings for the resumed run. Returns `None` if there
/// are no checkpoints, and an error if all are corrupt.
pub(super) fn find(request: &Request, changed: &ResumeSettings) -> Result<Option<ResumePoint>> {
    let mut first = None;
    for found in checkpoint_folder::list(&request.output)? {
        match read(&found.path) {
            Ok(resumed) => {
                tracing::info!("{}: resuming after step {}", found.path.display(), resumed.state.step);
                return decide(request, changed, resumed).map(Some);
            }
            Err(error) => {
                tracing::warn!("{error}; trying the previous checkpoint");
                first.get_or_insert(error);
            }
        }
    }
    match first {
        Some(error) => Err(error),
        None => {
            tracing::warn!("{} contains no checkpoint; training starts at step 1", request.output.display());
            Ok(None)
        }
    }
}

fn read(path: &Path) -> Result<ResumePoint> {
    let state = TrainState::read(path)?;
    let record = RunState::from_state(&state)?;
    let settings = Settings { read: record.read.clone(), train: state.config.clone(), run: record.run.clone() };
    settings.check().map_err(|error| Error::data(path, "contents", error.to_string()))?;
    Ok(ResumePoint { state, settings, record })
}

/// Applies the requested settings to the checkpoint and logs each change.
fn decide(request: &Request, changed: &ResumeSettings, mut resumed: ResumePoint) -> Result<ResumePoint> {
    let then = &resumed.settings;
    let mut wanted = changed(Some(then))?.settled();
    wanted.check()?;
    // Automatic values were decided when the run started.
    wanted.train.keep_decided(&then.train);
    compare(then, &wanted)?;
    if wanted.train.iterations < resumed.state.step {
        let (path, steps) = (resumed.state.path.display(), resumed.state.step);
        let problem = format!("is {}, and {path} has {steps} steps", wanted.train.iterations);
        return Err(Error::usage(Setting("iterations"), problem));
    }
    resumed.state.config = wanted.train.clone();
    resumed.settings = wanted;
    merge(&mut resumed.record.inputs, &request.inputs);
    if request.occluders.is_some() {
        tracing::info!("the checkpoint has the occluders; their files are not read again");
    }
    Ok(resumed)
}

/// Logs changed settings, and refuses changes to settings that are fixed within a run.
fn compare(then: &Settings, now: &Settings) -> Result<()> {
    let (then, now) = (then.texts(), now.texts());
    for key in Settings::keys() {
        let (then, now) = (then.get(key.name), now.get(key.name));
        if then == now {
            continue;
        }
        let text = |value: Option<&String>| value.map_or("not set", String::as_str).to_owned();
        let change = format!("{} in the checkpoint, now {}", text(then), text(now));
        if key.is_fixed {
            let problem = format!("{change}; it cannot change within a run; keep the old value, or start a new run");
            return Err(Error::usage(Setting(key.name), problem));
        }
        tracing::warn!("{}: {change}", Setting(key.name));
    }
    Ok(())
}

/// Replaces the checkpoint's inputs by those given now.
fn merge(then: &mut Inputs, now: &Inputs) {
    if let Some(bytes) = now.memory_limit
        && then.memory_limit != Some(bytes)
    {
        let text = then.memory_limit.map_or("not set".to_owned(), |bytes| bytes.to_string());
        tracing::warn!("{}: {text} in the checkpoint, now {bytes}", Setting("memory_limit"));
        then.memory_limit = Some(bytes);
    }
    let folder = |then: &mut Option<PathBuf>, now: &Option<PathBuf>| *then = now.clone().or(then.take());
    folder(&mut then.masks, &now.masks);
    folder(&mut then.ignore, &now.ignore);
    folder(&mut then.known_depths, &now.known_depths);
    folder(&mut then.images, &now.images);
    then.max_bad_photos = now.max_bad_photos.or(then.max_bad_photos);
    then.allow_outside |= now.allow_outside;
}

impl Inputs {
    /// Returns the inputs as a checkpoint stores them: with absolute paths, independent of the working directory.
    pub(super) fn recorded(&self) -> Self {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        // Paths that are not Unicode must be given again.
        let folder = |path: &Option<PathBuf>| path.as_deref().filter(|path| path.to_str().is_some()).map(absolute);
        Self {
            masks: folder(&self.masks),
            ignore: folder(&self.ignore),
            known_depths: folder(&self.known_depths),
            // A folder name inside the scene stays relative.
            images: self.images.as_deref().map(|path| if path.is_dir() { absolute(path) } else { path.to_owned() }),
            ..self.clone()
        }
    }
}
