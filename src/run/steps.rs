//! The training loop, and the files written between steps.

use super::checkpoints::CheckpointJob;
use super::models::ModelJob;
use super::preview::PreviewJob;
use super::{Event, Run};
use crate::error::{Error, Result};
use crate::phases::{self, Phase};
use crate::train::between::StepJob;
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
        run.tell_checkpoint()?;
        work_after(run, step)?;
        if run.stopped {
            break;
        }
    }
    run.end_checkpoint()?;
    run.history.drain(&mut run.trainer)
}

/// Writes the files that are due after a step.
fn work_after(run: &mut Run, step: u32) -> Result<()> {
    let jobs: [(&mut dyn StepJob<Run>, Phase); 3] =
        [(&mut ModelJob, Phase::Output), (&mut PreviewJob, Phase::Output), (&mut CheckpointJob, Phase::Checkpoint)];
    for (job, phase) in jobs {
        if job.is_due(step, run) {
            run.hold_folder()?;
            run.history.drain(&mut run.trainer)?;
            phases::timed(phase, || job.run(step, run))?;
        }
    }
    Ok(())
}

impl Run<'_> {
    /// Turns a failed write into a warning: there may be free space again at the end of the run.
    pub(super) fn tolerate<T>(&mut self, written: Result<T>) -> Result<Option<T>> {
        match written {
            Err(error @ Error::Write { .. }) => {
                self.warn(&format!("{error}; training continues without it")).map(|()| None)
            }
            other => other.map(Some),
        }
    }

    /// Checks that the folder still belongs to this run. Call this before each write.
    pub(super) fn hold_folder(&mut self) -> Result<()> {
        self.checkpoints.hold_folder()
    }
}
