//! The checkpoints that a run writes.

use super::history::{Recorder, Sums};
use super::resume::Record;
use super::{Event, Run};
use crate::error::{Error, Result};
use crate::files::run_folder::Lock;
use crate::records::checkpoint_folder;
use crate::train::between::Between;
use crate::train::{TrainState, Trainer};
use std::path::{Path, PathBuf};

/// Number of checkpoints that a run keeps while it goes on. The older one is the fallback if the newest is damaged.
const FILES_MAX: usize = 2;

pub(super) struct Checkpoints {
    out: PathBuf,
    lock: Lock,
    record: Record,
    /// Files of this run, the newest last.
    kept: Vec<PathBuf>,
    step: u32,
}

impl Checkpoints {
    /// Makes the list for a run in the locked folder `out` that continues from `resumed`.
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

    /// Checks that the folder still belongs to this run. Call it before each write: somebody may have deleted the
    /// folder and started another run there.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.lock.hold()
    }

    /// Returns true if the schedule has a checkpoint at `step`.
    fn is_due(&self, step: u32, last: u32) -> bool {
        let every = self.record.run.checkpoint_every;
        every > 0 && (step.is_multiple_of(every) || step == last)
    }

    /// Puts the training back to its last whole checkpoint after the failure `reason`. Returns its step and the sums of
    /// its history, none if there is no checkpoint.
    pub(super) fn restore(&mut self, trainer: &mut Trainer, reason: &Error) -> Result<Option<(u32, Sums)>> {
        while let Some(path) = self.kept.last() {
            match TrainState::read(path).and_then(|state| Ok((Record::of(&state)?, state))) {
                Ok((record, state)) => {
                    tracing::warn!("{reason}; training goes back to {}", path.display());
                    trainer.restore(&state)?;
                    self.step = state.step;
                    return Ok(Some((state.step, record.history)));
                }
                Err(error) => tracing::warn!("{error}; the checkpoint before it is tried"),
            }
            self.kept.pop();
        }
        Ok(None)
    }

    /// Writes the checkpoint that is due. A failed write or listing is only a warning: the next one may succeed.
    fn save_due(&mut self, trainer: &mut Trainer, history: &mut Recorder) -> Result<Option<PathBuf>> {
        self.hold_folder()?;
        match self.save(trainer, history) {
            Err(error @ (Error::Write { .. } | Error::Read { .. })) => {
                let last = self.kept.last().map_or("there is no checkpoint yet".to_owned(), |path| {
                    format!("the last checkpoint is {}", path.display())
                });
                tracing::warn!("{error}; training goes on, {last}");
                Ok(None)
            }
            other => other,
        }
    }

    /// Writes a checkpoint unless this step has one. Deletes old ones after the new one is complete. Nothing may be in
    /// flight, so that the history has all steps.
    pub(super) fn save(&mut self, trainer: &mut Trainer, history: &mut Recorder) -> Result<Option<PathBuf>> {
        let step = trainer.steps_done();
        if step == self.step {
            return Ok(None);
        }
        history.sync();
        self.record.history = history.unfinished();
        let mut state = trainer.state()?;
        state.run = serde_json::to_value(&self.record).map_err(|error| Error::Bug(format!("checkpoint: {error}")))?;
        let path = checkpoint_folder::next(&self.out, step)?;
        state.write(&path)?;
        self.step = step;
        self.kept.push(path.clone());
        self.keep(FILES_MAX)?;
        Ok(Some(path))
    }

    /// Deletes all but the last checkpoint at the end of the run.
    pub(super) fn finish(&mut self) -> Result<()> {
        if self.kept.is_empty() { Ok(()) } else { self.keep(1) }
    }

    fn keep(&mut self, most: usize) -> Result<()> {
        self.kept.drain(..self.kept.len().saturating_sub(most));
        checkpoint_folder::keep(&self.out, &self.kept)
    }
}

/// Writes a checkpoint.
pub(super) struct CheckpointJob;

impl Between<Run<'_>> for CheckpointJob {
    fn is_due(&self, step: u32, run: &Run) -> bool {
        run.checkpoints.is_due(step, run.settings.train.iterations)
    }

    fn run(&mut self, step: u32, run: &mut Run) -> Result<()> {
        match run.save_due()? {
            Some(path) => run.tell(Event::Checkpoint { step, path: &path }),
            // If the observer answers Save again, the step has its checkpoint already: no endless loop.
            None => Ok(()),
        }
    }
}

impl Run<'_> {
    /// Writes a checkpoint outside of the schedule.
    pub(super) fn save_checkpoint(&mut self) -> Result<()> {
        self.hold_folder()?;
        CheckpointJob.run(self.trainer.steps_done(), self)
    }

    /// Writes the checkpoint of a stopped run. Returns whether there is one.
    pub(super) fn keep_if_stopped(&mut self) -> Result<bool> {
        if !self.stopped {
            return Ok(false);
        }
        self.checkpoints.save(&mut self.trainer, &mut self.history).map(|_| true)
    }

    /// Writes a checkpoint, and what a report of the run until then needs.
    fn save_due(&mut self) -> Result<Option<PathBuf>> {
        self.history.drain(&mut self.trainer)?;
        let saved = self.checkpoints.save_due(&mut self.trainer, &mut self.history)?;
        // A checkpoint takes long enough for another run to come between.
        self.hold_folder()?;
        let written = self.write_info();
        self.tolerate(written)?;
        Ok(saved)
    }
}
