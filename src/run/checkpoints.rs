//! Writes a run's checkpoints on a thread while training continues.

use super::history::{Recorder, Sums};
use super::resume::RunState;
use super::{Event, Run};
use crate::error::{Error, Result};
use crate::files::run_folder::Lock;
use crate::lab::fault;
use crate::records::checkpoint_folder;
use crate::run::Every;
use crate::train::between::StepJob;
use crate::train::{PendingState, TrainState, Trainer};
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::Instant;

/// Checkpoints that a run keeps. The older one is the fallback if the newest is corrupt.
const FILES_MAX: usize = 2;

pub(super) struct Checkpoints {
    out: PathBuf,
    lock: Lock,
    record: RunState,
    /// Checkpoint files of this run, the newest last.
    kept: Vec<PathBuf>,
    /// Step of the last started checkpoint, and its time.
    step: u32,
    since: Instant,
    writer: Option<Writer>,
}

/// A checkpoint that is being written.
struct Writer {
    step: u32,
    path: PathBuf,
    /// `None` after joining.
    thread: Option<JoinHandle<Result<()>>>,
}

impl Writer {
    /// Starts writing on a thread.
    fn begin(step: u32, path: PathBuf, pending: PendingState) -> Result<Self> {
        let to = path.clone();
        let write = move || {
            // An injected fault can only cause a delay here.
            let pause = || fault::injected("checkpoint");
            pause();
            let whole = pending.whole()?;
            pause();
            whole.write(&to)?;
            pause();
            Ok(())
        };
        let thread = thread::Builder::new().name("checkpoint".to_owned()).spawn(write);
        let thread = thread.map_err(Error::write(&path))?;
        Ok(Self { step, path, thread: Some(thread) })
    }

    fn is_done(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the file. Returns its step and path.
    fn end(mut self) -> (u32, Result<PathBuf>) {
        let ended = self.thread.take().map_or(Ok(Ok(())), JoinHandle::join);
        let written =
            ended.unwrap_or_else(|_| Err(Error::Bug(format!("{}: the writing thread panicked", self.path.display()))));
        (self.step, written.map(|()| self.path.clone()))
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Finish a started checkpoint even if the run has failed.
        if let Some(Ok(Err(error))) = self.thread.take().map(JoinHandle::join) {
            tracing::warn!("the checkpoint of step {} is missing: {error}", self.step);
        }
    }
}

impl Checkpoints {
    /// Makes the list for a run in the locked folder `out` that continues from `resumed`.
    pub(super) fn new(out: &Path, lock: Lock, record: RunState, resumed: Option<&TrainState>) -> Result<Self> {
        if resumed.is_none()
            && let Some(old) = checkpoint_folder::list(out)?.first()
        {
            tracing::warn!(
                "{} is from an earlier run; this run deletes it at its first checkpoint. Resume that run to keep it",
                old.path.display()
            );
        }
        let (kept, step) = resumed.map_or((Vec::new(), 0), |state| (vec![state.path.clone()], state.step));
        Ok(Self { out: out.to_owned(), lock, record, kept, step, since: Instant::now(), writer: None })
    }

    /// Checks that the folder still belongs to this run. Call this before each write, because somebody may have deleted
    /// the folder and started another run there.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.lock.hold()
    }

    /// Returns true if a checkpoint is due at `step`.
    fn is_due(&self, step: u32, last: u32) -> bool {
        let every = self.record.run.checkpoint_every;
        every != Every::NEVER && (step == last || every.is_due(step, self.since))
    }

    /// Restores the training from its last intact checkpoint after the failure `reason`. Returns the step and the
    /// history sums; `None` if there is no checkpoint.
    pub(super) fn restore(&mut self, trainer: &mut Trainer, reason: &Error) -> Result<Option<(u32, Sums)>> {
        if let Some((step, Err(error))) = self.settle() {
            tracing::warn!("the checkpoint of step {step} is missing: {error}");
        }
        while let Some(path) = self.kept.last() {
            match TrainState::read(path).and_then(|state| Ok((RunState::from_state(&state)?, state))) {
                Ok((record, state)) => {
                    tracing::warn!("{reason}; training restarts from {}", path.display());
                    trainer.restore(&state)?;
                    self.step = state.step;
                    return Ok(Some((state.step, record.history)));
                }
                Err(error) => tracing::warn!("{error}; trying the previous checkpoint"),
            }
            self.kept.pop();
        }
        Ok(None)
    }

    /// Starts a checkpoint unless this step already has one. Nothing may be in flight, so that the history is complete,
    /// and no other checkpoint may be in progress.
    fn begin(&mut self, trainer: &mut Trainer, history: &mut Recorder) -> Result<()> {
        let step = trainer.steps_done();
        if step == self.step {
            return Ok(());
        }
        history.sync();
        self.record.history = history.unfinished();
        let mut pending = trainer.copied_state()?;
        pending.state.run =
            serde_json::to_value(&self.record).map_err(|error| Error::Bug(format!("checkpoint: {error}")))?;
        (self.step, self.since) = (step, Instant::now());
        self.writer = Some(Writer::begin(step, checkpoint_folder::next(&self.out, step)?, pending)?);
        Ok(())
    }

    /// Waits for the checkpoint in progress, then deletes old ones. Returns its step and path; `None` if there is none.
    fn settle(&mut self) -> Option<(u32, Result<PathBuf>)> {
        let (step, written) = self.writer.take()?.end();
        let written = written.and_then(|path| {
            self.kept.push(path.clone());
            self.keep(FILES_MAX).map(|()| path)
        });
        if written.is_err() {
            // The step may then be saved again.
            self.step = 0;
        }
        Some((step, written))
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

/// Starts a checkpoint.
pub(super) struct CheckpointJob;

impl StepJob<Run<'_>> for CheckpointJob {
    fn is_due(&self, step: u32, run: &Run) -> bool {
        run.checkpoints.is_due(step, run.settings.train.iterations)
    }

    fn run(&mut self, _step: u32, run: &mut Run) -> Result<()> {
        run.end_checkpoint()?;
        run.begin_checkpoint()
    }
}

impl Run<'_> {
    /// Writes a checkpoint outside of the schedule, and waits for it.
    pub(super) fn save_checkpoint(&mut self) -> Result<()> {
        self.hold_folder()?;
        self.end_checkpoint()?;
        self.begin_checkpoint()?;
        // If the observer answers Save again, the step already has its checkpoint, so there is no endless loop.
        self.end_checkpoint()
    }

    /// Writes the checkpoint of a stopped run. Returns true if there is one.
    pub(super) fn keep_if_stopped(&mut self) -> Result<bool> {
        if !self.stopped {
            return Ok(false);
        }
        self.end_checkpoint()?;
        self.checkpoints.begin(&mut self.trainer, &mut self.history)?;
        self.checkpoints.settle().map_or(Ok(true), |(_, written)| written.map(|_| true))
    }

    /// Reports a checkpoint that has been completed.
    pub(super) fn tell_checkpoint(&mut self) -> Result<()> {
        if self.checkpoints.writer.as_ref().is_some_and(Writer::is_done) { self.end_checkpoint() } else { Ok(()) }
    }

    /// Waits for the checkpoint in progress, if any, and reports it. Failures are only warnings, because the next
    /// checkpoint may succeed.
    pub(super) fn end_checkpoint(&mut self) -> Result<()> {
        let Some((step, written)) = self.checkpoints.settle() else { return Ok(()) };
        // Writing takes long enough for another run to take the folder.
        self.hold_folder()?;
        match self.or_warned(written)? {
            Some(path) => self.tell(Event::Checkpoint { step, path: &path }),
            None => Ok(()),
        }
    }

    /// Starts a checkpoint, and writes the files that a report needs.
    fn begin_checkpoint(&mut self) -> Result<()> {
        self.history.drain(&mut self.trainer)?;
        self.hold_folder()?;
        let begun = self.checkpoints.begin(&mut self.trainer, &mut self.history);
        self.or_warned(begun)?;
        // Copying the state takes a while.
        self.hold_folder()?;
        let written = self.write_info();
        self.tolerate(written).map(|_| ())
    }

    fn or_warned<T>(&self, written: Result<T>) -> Result<Option<T>> {
        match written {
            Err(error @ (Error::Write { .. } | Error::Read { .. })) => {
                let last = self.checkpoints.kept.last().map_or("there is no checkpoint yet".to_owned(), |path| {
                    format!("the last checkpoint is {}", path.display())
                });
                tracing::warn!("{error}; training continues, {last}");
                Ok(None)
            }
            other => other.map(Some),
        }
    }
}
