//! Work between two steps: when it is due, and what it does.
//!
//! A new job is a file that implements [`Between`], and its place in [`Jobs`]. [`crate::run`] has jobs too: they write files.

mod growth;
mod occluders;
mod pose_adjustment;
mod votes;

pub(super) use growth::Growth;
pub(super) use occluders::Occluders;
pub(super) use pose_adjustment::PoseAdjustment;
pub(super) use votes::Votes;

use super::context::Context;
use super::settings::TrainConfig;
use crate::error::Result;

/// Work between two steps, with what it works on.
pub(crate) trait Between<C: ?Sized> {
    /// Returns true if it is due at a step. Whether it comes before or after the step is up to the list that has it.
    fn is_due(&self, step: u32, context: &C) -> bool;

    /// Does it. Nothing is in flight.
    fn run(&mut self, step: u32, context: &mut C) -> Result<()>;
}

/// The place of work at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum When {
    /// Before it.
    Before,
    /// After it.
    After,
}

/// The jobs of a training.
pub(super) struct Jobs {
    pub(super) poses: PoseAdjustment,
    pub(super) votes: Votes,
    pub(super) occluders: Occluders,
    pub(super) growth: Growth,
}

impl Jobs {
    pub(super) fn new(config: &TrainConfig) -> Self {
        Self { poses: PoseAdjustment, votes: Votes::default(), occluders: Occluders, growth: Growth::new(config) }
    }

    /// Returns the jobs before or after a step, in their order.
    pub(super) fn list(&mut self, when: When) -> Vec<&mut dyn Between<Context>> {
        match when {
            When::Before => vec![&mut self.poses, &mut self.votes, &mut self.occluders],
            When::After => vec![&mut self.growth],
        }
    }
}
