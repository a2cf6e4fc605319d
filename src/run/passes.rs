//! Times the passes of the last steps, for the report.

use super::Run;
use crate::scene::Gaussians;
use crate::train::StepTimes;
use serde::{Deserialize, Serialize};

/// Most steps to repeat for timing.
const TIMED_STEPS_MAX: u32 = 16;
/// Steps of the run per timed step, so that timing takes at most half a percent of the training time.
const RUN_STEPS_PER_TIMED_STEP: u32 = 200;

/// Mean time of a pass in a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Pass {
    pub stage: String,
    pub name: String,
    /// Time of all items of the pass in a step, ms; `labelgs profile --json` writes a median.
    #[serde(alias = "median_ms")]
    pub ms: f64,
    /// Share of the step, 0 to 1.
    pub share: f64,
}

impl Run<'_> {
    /// Repeats the last steps to time their passes. Returns nothing for short runs, or if the device has no timestamps.
    pub(super) fn time_passes(&mut self, model: &Gaussians) {
        let has_clock = self.trainer.engine_mut().gpu().limits().timestamp_bits > 0;
        let count = (self.trainer.steps_done() / RUN_STEPS_PER_TIMED_STEP).min(TIMED_STEPS_MAX);
        if !has_clock || count == 0 {
            return;
        }
        match self.trainer.times_of_last(count, model) {
            Ok(times) => self.info.passes = means(&times),
            // The model is already saved and scored.
            Err(error) => tracing::warn!("{error}; the report will not have times by pass"),
        }
    }
}

/// Returns the means over the steps, in step order.
fn means(times: &[StepTimes]) -> Vec<Pass> {
    let mut passes: Vec<Pass> = Vec::new();
    for (stage, name, ns) in times.iter().flat_map(|times| &times.items) {
        let ms = *ns as f64 / 1e6 / times.len() as f64;
        match passes.iter_mut().find(|pass| pass.stage == stage.name && pass.name == *name) {
            Some(pass) => pass.ms += ms,
            None => passes.push(Pass { stage: stage.name.to_owned(), name: name.clone(), ms, share: 0.0 }),
        }
    }
    let all: f64 = passes.iter().map(|pass| pass.ms).sum();
    passes.iter_mut().for_each(|pass| pass.share = pass.ms / all.max(f64::MIN_POSITIVE));
    passes
}

#[cfg(test)]
mod tests {
    use super::means;
    use crate::pass::Stage;
    use crate::train::StepTimes;

    #[test]
    fn a_pass_that_not_every_step_has_counts_with_its_share() {
        let step = |items: &[(Stage, &str, u64)]| StepTimes {
            step: 1,
            is_first: false,
            items: items.iter().map(|(stage, name, ns)| (*stage, (*name).to_owned(), *ns)).collect(),
        };
        let sort = (Stage::SORT, "scan", 1_000_000);
        let found = means(&[step(&[sort, sort]), step(&[sort, sort, (Stage::LOSS, "labels", 2_000_000)])]);
        let rows: Vec<_> = found.iter().map(|pass| (pass.name.as_str(), pass.ms, pass.share)).collect();
        assert_eq!(rows, [("scan", 2.0, 2.0 / 3.0), ("labels", 1.0, 1.0 / 3.0)]);
    }
}
