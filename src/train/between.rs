//! Work on all views between two steps.

use super::{StepReport, Trainer};
use crate::error::Result;

impl Trainer {
    /// Does what is due before a step, after the steps in flight. Returns the reports of these.
    pub(super) fn work_before(&mut self, step: u32) -> Result<Vec<StepReport>> {
        let (poses, labels, occluders) =
            (self.adjusts_poses(step), self.counts_votes(step), self.refreshes_occluders(step));
        let is_due = poses || labels || occluders;
        let done = if is_due { self.drain()? } else { Vec::new() };
        if poses {
            self.adjust_poses()?;
        }
        if labels {
            self.refresh_labels()?;
        }
        if occluders {
            self.refresh_occluders()?;
        }
        Ok(done)
    }
}
