//! The checkpoints that a run leaves.

use super::resume::Record;
use crate::error::{Error, Result};
use crate::io::checkpoint_folder;
use crate::io::run_folder::Lock;
use crate::train::{TrainState, Trainer};
use std::path::{Path, PathBuf};

/// Checkpoints that are kept while a run goes on: should the newest be damaged, there is the one before.
const KEPT: usize = 2;

/// The checkpoints of a run.
pub(super) struct Checkpoints {
    out: PathBuf,
    lock: Lock,
    record: Record,
    /// Those of this run, the newest last.
    kept: Vec<PathBuf>,
    /// Step of the newest.
    step: u32,
}

impl Checkpoints {
    /// For a run in the folder `out`, which it has locked, that goes on from `resumed`.
    pub(super) fn new(out: &Path, lock: Lock, record: Record, resumed: Option<&TrainState>) -> Result<Self> {
        if resumed.is_none()
            && let Some(old) = checkpoint_folder::list(out)?.first()
        {
            tracing::warn!(
                "{} is of an earlier run; this run deletes it at its first checkpoint. Go on with that run to keep it",
                old.path.display()
            );
        }
        let (kept, step) = resumed.map_or((Vec::new(), 0), |state| (vec![state.path.clone()], state.step));
        Ok(Self { out: out.to_owned(), lock, record, kept, step })
    }

    /// Makes sure that the folder is still this run's, before anything is written: it may have been deleted, and another
    /// run begun in its place.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.lock.hold()
    }

    /// True where the schedule asks for one.
    pub(super) fn due(&self, step: u32, last: u32) -> bool {
        let every = self.record.run.checkpoint_every;
        every > 0 && (step.is_multiple_of(every) || step == last)
    }

    /// Puts a training back to its last whole checkpoint, because of what has gone wrong since. False if there is none.
    pub(super) fn restore(&mut self, trainer: &mut Trainer, reason: &Error) -> Result<bool> {
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
    pub(super) fn save_due(&mut self, trainer: &mut Trainer) -> Result<Option<PathBuf>> {
        self.hold_folder()?;
        match self.save(trainer) {
            Err(error @ (Error::Write { .. } | Error::Read { .. })) => {
                let last = self.kept.last().map_or("there is none yet".to_owned(), |path| path.display().to_string());
                tracing::warn!("{error}; training goes on, the last checkpoint is: {last}");
                Ok(None)
            }
            other => other,
        }
    }

    /// Writes one now, unless this step has one. Older ones go when it is safe.
    pub(super) fn save(&mut self, trainer: &mut Trainer) -> Result<Option<PathBuf>> {
        let step = trainer.steps_done();
        if step == self.step {
            return Ok(None);
        }
        let mut state = trainer.state()?;
        state.run = serde_json::to_value(&self.record).map_err(|error| Error::Bug(format!("checkpoint: {error}")))?;
        let path = checkpoint_folder::next(&self.out, step)?;
        state.write(&path)?;
        self.step = step;
        self.kept.push(path.clone());
        self.keep(KEPT)?;
        Ok(Some(path))
    }

    /// Leaves the last one only: the run has ended.
    pub(super) fn finish(&mut self) -> Result<()> {
        if self.kept.is_empty() { Ok(()) } else { self.keep(1) }
    }

    fn keep(&mut self, most: usize) -> Result<()> {
        self.kept.drain(..self.kept.len().saturating_sub(most));
        checkpoint_folder::keep(&self.out, &self.kept)
    }
}
