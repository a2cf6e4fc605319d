//! Recovery from lost devices and from NaNs.

use super::steps::steps;
use super::{Request, Run};
use crate::error::{Error, Result};
use crate::records::checkpoint_folder;
use crate::run::Summary;
use std::time::Duration;

/// Waiting times between attempts to reopen a lost device, s.
const REOPEN_WAITS_S: [u64; 3] = [1, 4, 16];

/// Runs a training. With [`Request::restart`], restarts after a lost device, unless no checkpoint was written since the
/// last loss: the same work would fail again. `run` receives true if it continues from the newest checkpoint.
pub(super) fn over_losses(request: &Request, run: &mut dyn FnMut(bool) -> Result<Summary>) -> Result<Summary> {
    if !request.restart {
        return run(false);
    }
    let newest = || Ok(checkpoint_folder::list(&request.output)?.first().map_or(0, |found| found.number));
    let (mut before, mut was_lost) = (newest()?, false);
    let mut waits = REOPEN_WAITS_S.iter();
    loop {
        let error = match run(was_lost) {
            Err(error @ Error::DeviceLost { .. }) => error,
            // A driver may need time to make a device available again.
            Err(error) if was_lost && error.is_without_device() => {
                let Some(&seconds) = waits.next() else { return Err(error) };
                tracing::warn!("{error}; trying again in {seconds} s");
                std::thread::sleep(Duration::from_secs(seconds));
                continue;
            }
            other => return other,
        };
        waits = REOPEN_WAITS_S.iter();
        let number = newest()?;
        if number <= before {
            return Err(error);
        }
        tracing::warn!("{error}; reopening it, and training continues from the newest checkpoint");
        (before, was_lost) = (number, true);
    }
}

/// Runs the steps. A first failure may be a device fault, so the steps are repeated with the same bits. A second
/// failure comes from the scene or the settings, and lower learning rates may avoid it.
pub(super) fn over_numeric_failures(run: &mut Run) -> Result<()> {
    let mut last = steps(run);
    for is_slower in [false, true] {
        last = match last {
            Err(error @ Error::Numeric { .. }) => {
                let Some((step, sums)) = run.checkpoints.restore(&mut run.trainer, &error)? else { return Err(error) };
                run.history.go_back(step, run.settings.train.iterations, sums);
                if is_slower {
                    run.trainer.halve_rates();
                    run.warn("training failed again; all learning rates are halved from here")?;
                }
                steps(run)
            }
            other => other,
        };
    }
    last
}

impl Run<'_> {
    /// Saves the model if the run ran out of memory. Steps that did not fit have not changed the model.
    pub(super) fn keep_model(&mut self, error: Error) -> Error {
        if !error.is_out_of_memory() {
            return error;
        }
        let step = self.trainer.steps_done();
        match self.trainer.model().and_then(|model| self.models.save(step, &model)) {
            Ok(path) => tracing::warn!(
                "stopped at step {step} of {}; the model so far is {}",
                self.settings.train.iterations,
                path.display()
            ),
            Err(second) => tracing::warn!("the model of step {step} could not be saved either: {second}"),
        }
        error
    }
}
