//! The checkpoint and the settings that a resumed run continues from.

use super::history::Sums;
use super::{Changed, Inputs, Request, Settings};
use crate::error::{Error, Result, Setting};
use crate::records::checkpoint_folder;
use crate::run::RunOptions;
use crate::scenes::ReadOptions;
use crate::train::TrainState;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The part of a checkpoint about the run. The state of the training is separate.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Record {
    pub inputs: Inputs,
    /// Source of the occluders at the start.
    pub occlusion: Option<String>,
    pub read: ReadOptions,
    pub run: RunOptions,
    /// Sums of the line of the history that was not finished.
    #[serde(default)]
    pub history: Sums,
}

impl Record {
    /// Reads the part of a checkpoint.
    pub(super) fn of(state: &TrainState) -> Result<Self> {
        serde_json::from_value(state.run.clone())
            .map_err(|error| Error::data(&state.path, "contents", format!("of the run: {error}")))
    }
}

/// A checkpoint to continue from.
pub(super) struct Resumed {
    pub state: TrainState,
    pub settings: Settings,
    pub record: Record,
}

/// Returns the newest whole checkpoint of the folder, with the settings for the resumed run. Returns none without
/// checkpoints, and an error if all are damaged.
pub(super) fn find(request: &Request, changed: &Changed) -> Result<Option<Resumed>> {
    let mut first = None;
    for found in checkpoint_folder::list(&request.output)? {
        match read(&found.path) {
            Ok(resumed) => {
                tracing::info!("{}: goes on after step {}", found.path.display(), resumed.state.step);
                return decide(request, changed, resumed).map(Some);
            }
            Err(error) => {
                tracing::warn!("{error}; the checkpoint before it is tried");
                first.get_or_insert(error);
            }
        }
    }
    match first {
        Some(error) => Err(error),
        None => {
            tracing::warn!("{} holds no checkpoint: training starts at step 1", request.output.display());
            Ok(None)
        }
    }
}

fn read(path: &Path) -> Result<Resumed> {
    let state = TrainState::read(path)?;
    let record = Record::of(&state)?;
    let settings = Settings { read: record.read.clone(), train: state.config.clone(), run: record.run.clone() };
    settings.check().map_err(|error| Error::data(path, "contents", error.to_string()))?;
    Ok(Resumed { state, settings, record })
}

/// Applies the requested settings to the checkpoint and logs each change.
fn decide(request: &Request, changed: &Changed, mut resumed: Resumed) -> Result<Resumed> {
    let then = &resumed.settings;
    let mut wanted = changed(Some(then))?;
    wanted.check()?;
    // Automatic values were decided when the run began.
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
        tracing::info!("occluders come from the checkpoint; their files are not read again");
    }
    Ok(resumed)
}

/// Logs changed settings, and refuses changes of settings that are fixed within a run.
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
            let problem = format!("{change}; it cannot change within a run: keep the old value, or start a new run");
            return Err(Error::usage(Setting(key.name), problem));
        }
        tracing::warn!("{}: {change}", Setting(key.name));
    }
    Ok(())
}

/// Replaces the inputs of the checkpoint by those given now.
fn merge(then: &mut Inputs, now: &Inputs) {
    if let Some(bytes) = now.memory_limit
        && then.memory_limit != Some(bytes)
    {
        let text = then.memory_limit.map_or("not set".to_owned(), |bytes| bytes.to_string());
        tracing::warn!("{}: {text} in the checkpoint, now {bytes}", Setting("memory_limit"));
        then.memory_limit = Some(bytes);
    }
    if let Some(masks) = &now.masks {
        then.masks = Some(absolute(masks));
    }
    if let Some(ignore) = &now.ignore {
        then.ignore = Some(absolute(ignore));
    }
    if let Some(depths) = &now.known_depths {
        then.known_depths = Some(absolute(depths));
    }
    then.max_bad_photos = now.max_bad_photos.or(then.max_bad_photos);
    then.allow_outside |= now.allow_outside;
    if let Some(images) = &now.images {
        then.images = Some(place_of_photos(images));
    }
}

/// Returns a folder of photos as a checkpoint stores it: one of the scene keeps its name.
pub(super) fn place_of_photos(images: &Path) -> PathBuf {
    if images.is_dir() { absolute(images) } else { images.to_owned() }
}

/// Returns an absolute path, independent of the working directory.
pub(super) fn absolute(folder: &Path) -> PathBuf {
    std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned())
}
