//! What is done when a device or the numbers fail.

use super::steps::steps;
use super::{Request, Run};
use crate::error::{Error, Result};
use crate::io::checkpoint_folder;
use crate::run::Summary;
use std::time::Duration;

/// Seconds between looks for a device after one was lost.
const WAITS: [u64; 3] = [1, 4, 16];

/// Runs a training, with [`Request::restart`] also over losses of the device: one that is lost twice without a checkpoint
/// in between would be lost again. The training is told whether it goes on from the newest checkpoint.
pub(super) fn over_losses(request: &Request, run: &mut dyn FnMut(bool) -> Result<Summary>) -> Result<Summary> {
    if !request.restart {
        return run(false);
    }
    let newest = || Ok(checkpoint_folder::list(&request.output)?.first().map_or(0, |found| found.number));
    let (mut before, mut was_lost) = (newest()?, false);
    let mut waits = WAITS.iter();
    loop {
        let error = match run(was_lost) {
            Err(error @ Error::DeviceLost { .. }) => error,
            // A driver may take a while until it has a device again.
            Err(error) if was_lost && error.is_without_device() => {
                let Some(&seconds) = waits.next() else { return Err(error) };
                tracing::warn!("{error}; tried again in {seconds} s");
                std::thread::sleep(Duration::from_secs(seconds));
                continue;
            }
            other => return other,
        };
        waits = WAITS.iter();
        let number = newest()?;
        if number <= before {
            return Err(error);
        }
        tracing::warn!("{error}; it is opened again, and training goes on from the newest checkpoint");
        (before, was_lost) = (number, true);
    }
}

/// Runs the steps. First a device that erred once is made up for, bit for bit. What fails again has its reason in the
/// scene or in the settings, and slower steps may get past it.
pub(super) fn over_numeric_failures(run: &mut Run) -> Result<()> {
    let mut last = steps(run);
    for is_slower in [false, true] {
        last = match last {
            Err(error @ Error::Numeric { .. }) if run.checkpoints.restore(&mut run.trainer, &error)? => {
                if is_slower {
                    run.trainer.halve_rates();
                    run.warn("it went wrong again: from here on all learning rates are half of what they were")?;
                }
                steps(run)
            }
            other => other,
        };
    }
    last
}

impl Run<'_> {
    /// A run that memory ended keeps what it has learnt: steps that did not fit changed nothing.
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
