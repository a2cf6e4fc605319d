//! The loop over steps, and the files written between steps.

use super::{Event, Run, preview};
use crate::error::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Runs the remaining steps, until the last one or until the observer stops the run.
pub(super) fn steps(run: &mut Run) -> Result<()> {
    let last = run.settings.train.iterations;
    for step in run.trainer.steps_done() + 1..=last {
        let start = Instant::now();
        let finished = run.trainer.step()?;
        let gaussians = run.trainer.gaussian_count();
        run.history.submitted(step, step == last, gaussians, start.elapsed());
        run.history.finished(&finished);
        if let Some(what) = run.trainer.take_densified() {
            run.history.densified(step, what);
            run.tell(Event::Densified { step, what, gaussians })?;
        }
        let report = run.trainer.newest_report();
        run.tell(Event::Step { step, report: report.as_ref(), is_last: step == last })?;
        if step < last {
            write_between(run, step)?;
        }
        if run.checkpoints.due(step, last)
            && let Some(path) = run.save_due()?
        {
            run.tell(Event::Checkpoint { step, path: &path })?;
        }
        if run.stopped {
            break;
        }
    }
    run.history.drain(&mut run.trainer)
}

/// Writes the model and the preview if the schedule has them at this step.
fn write_between(run: &mut Run, step: u32) -> Result<()> {
    let options = &run.settings.run;
    let (saves, previews) =
        (options.save_at.contains(&step), options.preview_every > 0 && step.is_multiple_of(options.preview_every));
    if saves {
        run.hold_folder()?;
        run.history.drain(&mut run.trainer)?;
        let model = run.trainer.labelled_model()?;
        let saved = run.models.save(step, &model);
        if let Some(path) = tolerate(run, saved)? {
            run.tell(Event::Model { step, path: &path })?;
        }
    }
    if previews {
        run.hold_folder()?;
        let written = preview::write(run);
        if let Some(path) = tolerate(run, written)?.flatten() {
            run.tell(Event::Preview { step, path: &path })?;
        }
    }
    Ok(())
}

/// Turns a failed write into a warning: there may be space again at the end of the training.
fn tolerate<T>(run: &mut Run, written: Result<T>) -> Result<Option<T>> {
    match written {
        Err(error @ Error::Write { .. }) => run.warn(&format!("{error}; training goes on without it")).map(|()| None),
        other => other.map(Some),
    }
}

impl Run<'_> {
    /// Checks that the folder still belongs to this run. Call it before each write.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.checkpoints.hold_folder()
    }

    pub(super) fn save_checkpoint(&mut self) -> Result<()> {
        self.hold_folder()?;
        let step = self.trainer.steps_done();
        match self.save_due()? {
            // If the observer answers Save again, the step has its checkpoint already: no endless loop.
            Some(path) => self.tell(Event::Checkpoint { step, path: &path }),
            None => Ok(()),
        }
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
        tolerate(self, written)?;
        Ok(saved)
    }
}
