//! The loop over steps, and what is written between two of them.

use super::{Event, Run, preview};
use crate::error::{Error, Result};

/// Runs the steps that are left; the observer may end it after any.
pub(super) fn steps(run: &mut Run) -> Result<()> {
    let last = run.settings.train.iterations;
    for step in run.trainer.steps_done() + 1..=last {
        run.trainer.step()?;
        if let Some(what) = run.trainer.take_densified() {
            let gaussians = run.trainer.gaussian_count();
            run.tell(Event::Densified { step, what, gaussians })?;
        }
        let report = run.trainer.newest_report();
        run.tell(Event::Step { step, report: report.as_ref(), is_last: step == last })?;
        if step < last {
            write_between(run, step)?;
        }
        if run.checkpoints.due(step, last) {
            run.trainer.drain()?;
            if let Some(path) = run.checkpoints.save_due(&mut run.trainer)? {
                run.tell(Event::Checkpoint { step, path: &path })?;
            }
        }
        if run.stopped {
            break;
        }
    }
    run.trainer.drain().map(drop)
}

/// The model and the preview, where the schedule asks for them.
fn write_between(run: &mut Run, step: u32) -> Result<()> {
    let options = &run.settings.run;
    let (saves, previews) =
        (options.save_at.contains(&step), options.preview_every > 0 && step.is_multiple_of(options.preview_every));
    if saves {
        run.hold_folder()?;
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

/// That something cannot be written on the way ends no training: there may be room again at its end.
fn tolerate<T>(run: &mut Run, written: Result<T>) -> Result<Option<T>> {
    match written {
        Err(error @ Error::Write { .. }) => run.warn(&format!("{error}; training goes on without it")).map(|()| None),
        other => other.map(Some),
    }
}

impl Run<'_> {
    /// Makes sure that the folder is still this run's, before anything is written.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.checkpoints.hold_folder()
    }

    /// Writes a checkpoint now, unless this step has one.
    pub(super) fn save_checkpoint(&mut self) -> Result<()> {
        self.hold_folder()?;
        let step = self.trainer.steps_done();
        match self.checkpoints.save_due(&mut self.trainer)? {
            // A Save in answer to this would find that the step has one.
            Some(path) => self.tell(Event::Checkpoint { step, path: &path }),
            None => Ok(()),
        }
    }

    /// The checkpoint of a run that was stopped. Returns whether there is one.
    pub(super) fn keep_if_stopped(&mut self) -> Result<bool> {
        if self.stopped { self.checkpoints.save(&mut self.trainer).map(|_| true) } else { Ok(false) }
    }
}
