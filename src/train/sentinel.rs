//! Watches for NaNs and infinities through the counters of the device.
//!
//! * A *gradient* that is not finite, or above 1e18 so that its square overflows, counts as 0 in that step
//!   (project_backward). The log counts them. The training ends after three steps in a row in which more than
//!   [`SHARE_MAX`] of the splats have such gradients.
//! * A *parameter* that is not finite, or so large that its projection is not, is the fault of the device or of its
//!   input, not of such a step. The first one that cull or project_forward finds ends the training, and so does a loss
//!   of NaN. The caller can go back to a saved state ([`Trainer::restore`](super::Trainer::restore)).

use super::Trainer;
use super::step_input::StepInput;
use crate::engine::Report;
use crate::error::{Error, Result};

/// Share of the splats whose gradients may be dropped; [`COUNT_MAX`] are always accepted.
const SHARE_MAX: f64 = 1e-3;
const COUNT_MAX: u32 = 10;
/// Number of successive steps above that share which ends a training.
const STEPS_MAX: u32 = 3;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// Number of dropped gradients so far, and the number for the next log message.
    dropped: u64,
    next_word: u64,
    /// Successive steps with too many dropped gradients.
    bad_steps: u32,
}

impl Trainer {
    /// Halves all learning rates for the rest of the run.
    pub fn halve_rates(&mut self) {
        self.config.halve_rates();
    }

    pub(super) fn watch(&mut self, input: &StepInput, report: &Report, losses: [f64; 2]) -> Result<()> {
        let counters = &report.counters;
        let view = &self.views[self.views.index(input)].name;
        let failure = |quantity: String| Error::Numeric { quantity, step: u64::from(input.step), view: view.clone() };
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
        let (count, seen) = (counters.nonfinite_count, &mut self.seen);
        let most = COUNT_MAX.max((SHARE_MAX * f64::from(counters.visible_count)) as u32);
        seen.bad_steps = if count > most { seen.bad_steps + 1 } else { 0 };
        if count > 0 {
            seen.dropped += u64::from(count);
            if seen.dropped >= seen.next_word {
                seen.next_word = seen.dropped * 10;
                tracing::warn!(
                    "step {}, view {view}: project_backward dropped the gradients of {count} Gaussians that are not \
                     finite, the first is that of Gaussian {}; {} so far",
                    input.step,
                    counters.nonfinite_first,
                    seen.dropped
                );
            }
        }
        if seen.bad_steps >= STEPS_MAX {
            return Err(failure(format!(
                "project_backward dropped the gradients of {count} of {} Gaussians, the first is {}, and of more than \
                 {most} in each of {STEPS_MAX} steps",
                counters.visible_count, counters.nonfinite_first
            )));
        }
        Ok(())
    }
}
