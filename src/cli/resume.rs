//! `labelgs train --resume`: from which checkpoint and with what settings a run goes on, and the checkpoints that it
//! leaves.

use super::config;
use super::train_args::TrainArgs;
use crate::io::checkpoint_folder;
use crate::io::run_folder::Lock;
use crate::train::{RunFacts, TrainConfig, TrainState, Trainer};
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Checkpoints that are kept while a run goes on: should the newest be damaged, there is the one before.
const KEPT: usize = 2;

/// Settings that cannot change within a run: the scene was read with them, or what is in memory has their shape.
const FIXED: [&str; 7] = ["seed", "test-every", "max-resolution", "background", "sh-degree", "label-rule", "occlusion"];

/// The newest whole checkpoint of the folder, with the settings that the run is to go on with. None if there is nothing
/// to go on from; an error if there are checkpoints, and all are damaged.
pub fn find(args: &TrainArgs) -> Result<Option<TrainState>> {
    if !args.resume {
        return Ok(None);
    }
    let mut first = None;
    for found in checkpoint_folder::list(&args.output)? {
        match TrainState::read(&found.path) {
            Ok(state) => {
                tracing::info!("{}: goes on after step {}", found.path.display(), state.step);
                return decide(args, state).map(Some);
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
            tracing::warn!("{} holds no checkpoint: training starts at step 1", args.output.display());
            Ok(None)
        }
    }
}

/// Puts what was typed over the settings of the checkpoint, and says what that changes.
fn decide(args: &TrainArgs, mut state: TrainState) -> Result<TrainState> {
    // A configuration that is named again is compared as a whole.
    let mut wanted = match &args.config {
        Some(path) => config::read(path)?,
        None if args.run.paper => TrainConfig::paper(),
        None => state.config.clone(),
    };
    args.apply(&mut wanted);
    wanted.check()?;
    if wanted.near == 0.0 {
        // Left to the scene, and that was decided when the run began.
        wanted.near = state.config.near;
    }
    let (then, now) = (config::fields(&state.config), config::fields(&wanted));
    for flag in then.keys().chain(now.keys()).collect::<BTreeSet<_>>() {
        let (then, now) = (then.get(flag), now.get(flag));
        if then == now {
            continue;
        }
        let text = |value: Option<&String>| value.map_or("not set", String::as_str).to_owned();
        let change = format!("{} in the checkpoint, now {}", text(then), text(now));
        if FIXED.contains(&flag.as_str()) {
            let problem = format!("{change}; it cannot change within a run: leave it out, or train without --resume");
            return Err(Error::usage(format!("--{flag}"), problem));
        }
        tracing::warn!("--{flag}: {change}");
    }
    if wanted.iterations < state.step {
        let problem = format!("is {}, and {} has {} steps", wanted.iterations, state.path.display(), state.step);
        return Err(Error::usage("--iterations", problem));
    }
    state.config = wanted;
    if let Some(bytes) = args.memory_limit
        && state.run.memory_limit != Some(bytes)
    {
        let then = state.run.memory_limit.map_or("not set".to_owned(), |bytes| bytes.to_string());
        tracing::warn!("--memory-limit: {then} in the checkpoint, now {bytes}");
        state.run.memory_limit = Some(bytes);
    }
    if let Some(masks) = &args.masks {
        state.run.masks = named(masks);
    }
    state.run.max_bad_photos = args.read.max_bad_photos.or(state.run.max_bad_photos);
    state.run.allow_outside |= args.read.allow_outside;
    if args.depths.is_some() || args.occlusion_file.is_some() {
        tracing::info!("occluders come from the checkpoint; their files are not read again");
    }
    Ok(state)
}

/// What a run is given besides its configuration, for its checkpoints.
pub fn facts(args: &TrainArgs, resumed: Option<&TrainState>) -> RunFacts {
    match resumed {
        Some(state) => state.run.clone(),
        None => RunFacts {
            masks: args.masks.as_deref().and_then(named),
            memory_limit: args.memory_limit,
            occlusion: None,
            max_bad_photos: args.read.max_bad_photos,
            allow_outside: args.read.allow_outside,
        },
    }
}

/// A folder as another working directory finds it; none if it cannot be written as text, and must be typed again.
fn named(folder: &Path) -> Option<String> {
    std::path::absolute(folder).ok()?.to_str().map(str::to_owned)
}

/// The checkpoints of a run.
pub struct Checkpoints {
    out: PathBuf,
    lock: Lock,
    run: RunFacts,
    /// Those of this run, the newest last.
    kept: Vec<PathBuf>,
    /// Step of the newest.
    step: u32,
}

impl Checkpoints {
    /// For a run in the folder `out`, which it has locked, that goes on from `resumed`.
    pub fn new(out: &Path, lock: Lock, run: RunFacts, resumed: Option<&TrainState>) -> Result<Self> {
        if resumed.is_none()
            && let Some(old) = checkpoint_folder::list(out)?.first()
        {
            tracing::warn!(
                "{} is of an earlier run and goes when this one has a checkpoint; --resume goes on from it",
                old.path.display()
            );
        }
        let (kept, step) = resumed.map_or((Vec::new(), 0), |state| (vec![state.path.clone()], state.step));
        Ok(Self { out: out.to_owned(), lock, run, kept, step })
    }

    /// Makes sure that the folder is still this run's, before anything is written: it may have been deleted, and another
    /// run begun in its place.
    pub fn hold_folder(&mut self) -> Result<()> {
        self.lock.hold()
    }

    /// True where the schedule asks for one.
    pub fn due(&self, trainer: &Trainer) -> bool {
        let (step, config) = (trainer.steps_done(), trainer.config());
        let every = config.checkpoint_every;
        every > 0 && (step.is_multiple_of(every) || step == config.iterations)
    }

    /// Puts a training back to its last whole checkpoint, because of what has gone wrong since. False if there is none.
    pub fn restore(&mut self, trainer: &mut Trainer, reason: &Error) -> Result<bool> {
        while let Some(path) = self.kept.last() {
            match TrainState::read(path) {
                Ok(state) => {
                    tracing::warn!("{reason}; training goes back to {}", path.display());
                    trainer.restore(&state)?;
                    self.step = state.step;
                    return Ok(true);
                }
                Err(error) => tracing::warn!("{error}; the checkpoint before it is tried"),
            }
            self.kept.pop();
        }
        Ok(false)
    }

    /// Writes one that is due. That it cannot be written, or its folder be listed, ends no training: there may be room again
    /// the next time.
    pub fn save_due(&mut self, trainer: &mut Trainer) -> Result<()> {
        self.hold_folder()?;
        match self.save(trainer) {
            Err(error @ (Error::Write { .. } | Error::Read { .. })) => {
                let last = self.kept.last().map_or("there is none yet".to_owned(), |path| path.display().to_string());
                tracing::warn!("{error}; training goes on, the last checkpoint is: {last}");
                Ok(())
            }
            other => other,
        }
    }

    /// Writes one now, unless this step has one. Older ones go when it is safe.
    pub fn save(&mut self, trainer: &mut Trainer) -> Result<()> {
        let step = trainer.steps_done();
        if step == self.step {
            return Ok(());
        }
        let mut state = trainer.state()?;
        state.run = self.run.clone();
        let path = checkpoint_folder::next(&self.out, step)?;
        state.write(&path)?;
        self.step = step;
        self.kept.push(path);
        self.keep(KEPT)
    }

    /// Leaves the last one only: the run has ended.
    pub fn finish(&mut self) -> Result<()> {
        if self.kept.is_empty() { Ok(()) } else { self.keep(1) }
    }

    fn keep(&mut self, most: usize) -> Result<()> {
        self.kept.drain(..self.kept.len().saturating_sub(most));
        checkpoint_folder::keep(&self.out, &self.kept)
    }
}
