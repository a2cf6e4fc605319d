//! Work between two steps: when it is due, and what it does.
//!
//! To add a job, implement [`StepJob`] in a new file and add it to [`TrainingJobs`]. [`crate::run`] has further jobs,
//! which write files.

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

/// A job between two steps; `C` is the state it works on.
pub(crate) trait StepJob<C: ?Sized> {
    /// Returns true if the job is due at a step. The list that contains it decides whether it runs before or after the
    /// step.
    fn is_due(&self, step: u32, context: &C) -> bool;

    /// Runs the job. Nothing is in flight.
    fn run(&mut self, step: u32, context: &mut C) -> Result<()>;
}

/// When a job runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JobTime {
    /// Before the step.
    Before,
    /// After the step.
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
