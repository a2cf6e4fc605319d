//! Watches for NaNs and infinities through the counters of the device.
//!
//! * A *gradient* that is not finite, or above 1e18 so that its square overflows, is set to 0 in that step
//!   (project_backward). The log counts them. Training ends after three consecutive steps in which more than
//!   [`DROPPED_SHARE_MAX`] of the splats have such gradients.
//! * A *parameter* that is not finite, or so large that its projection is not, comes from the device or its
//!   input, not from such a step. The first one that cull or project_forward finds ends the training, as does a NaN
//!   loss. The caller can restore a saved state ([`Trainer::restore`](crate::train::Trainer::restore)).

use crate::error::{Error, Result};
use crate::train::report::StepReport;

/// Share of the splats whose gradients may be dropped; [`DROPPED_COUNT_MAX`] are always accepted.
const DROPPED_SHARE_MAX: f64 = 1e-3;
const DROPPED_COUNT_MAX: u32 = 10;
/// Number of consecutive steps above that share that ends a training.
const BAD_STEPS_MAX: u32 = 3;

/// Watches for dropped gradients.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sentinel {
    /// Number of dropped gradients so far, and the number for the next log message.
    dropped: u64,
    next_word: u64,
    /// Consecutive steps with too many dropped gradients.
    bad_steps: u32,
}

impl Sentinel {
    /// Fails if a finished step on a view has broken the model.
    pub(super) fn check(&mut self, of: &StepReport, view: &str) -> Result<()> {
        let (counters, losses) = (&of.report.counters, [of.loss, of.label_loss]);
        let failure = |quantity| Error::Numeric { quantity, step: u64::from(of.step), view: view.to_owned() };
        for (pass, what, count, first) in [
            ("cull", "positions, opacities or scales", counters.broken_count, counters.broken_first),
            ("project_forward", "projections or colours", counters.unprojected_count, counters.unprojected_first),
        ] {
            if count > 0 {
                return Err(failure(format!(
                    "{pass} found {count} Gaussians with {what} that are not finite, the first is {first}"
                )));
            }
        }
        if !losses.iter().all(|loss| loss.is_finite()) {
            return Err(failure(format!("loss_reduce: the loss is {} and the label loss {}", losses[0], losses[1])));
        }
        let count = counters.nonfinite_count;
        let most = DROPPED_COUNT_MAX.max((DROPPED_SHARE_MAX * f64::from(counters.visible_count)) as u32);
        self.bad_steps = if count > most { self.bad_steps + 1 } else { 0 };
        if count > 0 {
            self.dropped += u64::from(count);
            if self.dropped >= self.next_word {
                self.next_word = self.dropped * 10;
                tracing::warn!(
                    "step {}, view {view}: project_backward dropped the gradients of {count} Gaussians that are not \
                     finite, the first is that of Gaussian {}; {} so far",
                    of.step,
                    counters.nonfinite_first,
                    self.dropped
                );
            }
        }
        if self.bad_steps >= BAD_STEPS_MAX {
            return Err(failure(format!(
                "project_backward dropped the gradients of {count} of {} Gaussians, the first is {}, and of more than \
                 {most} in each of {BAD_STEPS_MAX} steps",
                counters.visible_count, counters.nonfinite_first
            )));
        }
        Ok(())
    }
}
