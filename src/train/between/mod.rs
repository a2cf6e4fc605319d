//! Work between two steps: when it is due, and what it does.
//!
//! A new job is a file that implements [`StepJob`], and its place in [`TrainingJobs`]. [`crate::run`] has jobs too:
//! they write files.

mod growth;
mod occluders;
mod pose_adjustment;
mod votes;

pub(super) use growth::Growth;
pub(super) use occluders::OccluderJob;
pub(super) use pose_adjustment::PoseAdjustment;
pub(super) use votes::VoteJob;

use super::context::Context;
use super::settings::TrainConfig;
use crate::error::Result;

/// Work between two steps, with what it works on.
pub(crate) trait StepJob<C: ?Sized> {
    /// Returns true if it is due at a step. Whether it comes before or after the step is up to the list that has it.
    fn is_due(&self, step: u32, context: &C) -> bool;

    /// Does it. Nothing is in flight.
    fn run(&mut self, step: u32, context: &mut C) -> Result<()>;
}

/// The place of work at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JobTime {
    /// Before it.
    Before,
    /// After it.
    After,
}

/// The jobs of a training.
pub(super) struct TrainingJobs {
    pub(super) poses: PoseAdjustment,
    pub(super) votes: VoteJob,
    pub(super) occluders: OccluderJob,
    pub(super) growth: Growth,
}

impl TrainingJobs {
    pub(super) fn new(config: &TrainConfig) -> Self {
        Self { poses: PoseAdjustment, votes: VoteJob::default(), occluders: OccluderJob, growth: Growth::new(config) }
    }

    /// Returns the jobs before or after a step, in their order.
    pub(super) fn list(&mut self, when: JobTime) -> Vec<&mut dyn StepJob<Context>> {
        match when {
            JobTime::Before => vec![&mut self.poses, &mut self.votes, &mut self.occluders],
            JobTime::After => vec![&mut self.growth],
        }
    }
}
