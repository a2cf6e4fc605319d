//! Watches the numbers of a training through what the device counts.
//!
//! * A Gaussian whose *gradient* is not finite, or beyond 1e18 so that its square would not be, has gradient 0 in that
//!   step (project_backward). It is counted and said; three steps in a row in which that befalls more than
//!   [`SHARE_MAX`] of the splats end the training.
//! * A *parameter* that is not finite, or so large that the projection is not, can come from no such step: a device
//!   has gone wrong, or what it was given. The first one found by cull or project_forward ends the training, as does a
//!   loss that is no number. Whoever runs it restores what was saved before ([`Trainer::restore`](super::Trainer::restore)).

use super::Trainer;
use super::step_input::StepInput;
use crate::engine::Report;
use crate::error::{Error, Result};

/// Part of the splats whose gradients may be dropped, and at least [`COUNT_MAX`] of them.
const SHARE_MAX: f64 = 1e-3;
const COUNT_MAX: u32 = 10;
/// Steps in a row beyond that which end a training.
const STEPS_MAX: u32 = 3;

/// What was seen so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// Gradients dropped so far, and the number at which that is said again.
    dropped: u64,
    next_word: u64,
    /// Steps in a row with too many.
    bad_steps: u32,
}

impl Trainer {
    /// Looks at what a step counted.
    pub(super) fn watch(&mut self, input: &StepInput, report: &Report, losses: [f64; 2]) -> Result<()> {
        let counters = &report.counters;
        let view = &self.views[input.view].name;
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
            return Err(failure(format!("loss_reduce: the loss is {}, the label loss {}", losses[0], losses[1])));
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
                     finite, the first of Gaussian {}; {} so far",
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
