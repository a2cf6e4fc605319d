//! Times of the passes of each step, for `labelgs profile` and the report of a run.

use super::Trainer;
use crate::engine::Recording;
use crate::error::Result;
use crate::pass::Stage;
use crate::scene::Gaussians;
use std::collections::HashSet;

/// Times of the passes of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTimes {
    /// Step, from 1.
    pub step: u32,
    /// The first run of a recording, in which drivers compile.
    pub is_first: bool,
    /// Stage, name and nanoseconds of each item, in order.
    pub items: Vec<(Stage, String, u64)>,
}

#[derive(Debug, Default)]
pub(super) struct Timing {
    seen: HashSet<Recording>,
    times: Vec<StepTimes>,
}

impl Trainer {
    /// Collects the times of steps from now on. The scheduler needs timestamps.
    pub fn keep_times(&mut self) {
        self.timing.get_or_insert_default();
    }

    /// Sets whether the next steps count the (pixel, splat) pairs with a weight. Counting slows them down.
    pub fn count_pairs(&mut self, on: bool) {
        self.counts_pairs = on;
    }

    /// Takes the times of the steps that ended since the last call.
    pub fn take_times(&mut self) -> Vec<StepTimes> {
        self.timing.as_mut().map(|timing| std::mem::take(&mut timing.times)).unwrap_or_default()
    }

    /// Runs the last `count` steps again on `model` and returns their times, each with a barrier before every pass. All
    /// steps are done; the engine's model and the trainer are of no use after this.
    pub(crate) fn times_of_last(&mut self, count: u32, model: &Gaussians) -> Result<Vec<StepTimes>> {
        self.drain()?;
        self.engine.upload_model(model)?;
        self.engine.time_items()?;
        self.keep_times();
        for step in self.step - count.min(self.step)..self.step {
            let input = self.input(step + 1)?;
            self.submit_next(input)?;
        }
        self.drain()?;
        Ok(self.take_times())
    }

    /// Reads the times of a finished step whose frame was not used again.
    pub(super) fn note_times(&mut self, step: u32, recording: Recording) -> Result<()> {
        if let Some(timing) = &mut self.timing {
            let items = self.engine.times(recording)?;
            timing.times.push(StepTimes { step, is_first: timing.seen.insert(recording), items });
        }
        Ok(())
    }
}
