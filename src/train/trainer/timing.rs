//! Pass times of each step, for `labelgs profile` and run reports.

use crate::engine::{Engine, Recording};
use crate::error::Result;
use crate::pass::Stage;
use std::collections::HashSet;

/// Pass times of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTimes {
    /// Step, from 1.
    pub step: u32,
    /// True for the first run of a recording, in which drivers compile.
    pub is_first: bool,
    /// Stage, name and nanoseconds of each item, in order.
    pub items: Vec<(Stage, String, u64)>,
}

/// Times that have not been taken yet.
#[derive(Debug, Default)]
pub(super) struct Timing {
    seen: HashSet<Recording>,
    times: Vec<StepTimes>,
}

impl Timing {
    /// Reads the times of a finished step whose frame was not used again.
    pub(super) fn note(&mut self, engine: &mut Engine, step: u32, recording: Recording) -> Result<()> {
        let items = engine.times(recording)?;
        self.times.push(StepTimes { step, is_first: self.seen.insert(recording), items });
        Ok(())
    }

    pub(super) fn take(&mut self) -> Vec<StepTimes> {
        std::mem::take(&mut self.times)
    }
}
