//! Labels Gaussians by votes, counted over all training views at intervals and at the end.

use super::StepJob;
use crate::error::Result;
use crate::label::vote::ballot::Sweep;
use crate::label::vote::decide::{self, Decision};
use crate::train::context::Context;
use crate::train::objective::Parameter;
use crate::train::{LabelRule, TrainConfig};

/// Counts votes and labels the Gaussians.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::train) struct VoteJob {
    /// True if the Gaussians already have voted labels, with which masks can be compared.
    pub(in crate::train) have_labelled: bool,
}

impl VoteJob {
    /// Returns true if votes decide labels.
    fn decide(context: &Context) -> bool {
        let TrainConfig { label_rule, .. } = context.config;
        context.has_labels() && context.objective.trains(Parameter::Labels) && label_rule == LabelRule::Votes
    }

    /// Counts the votes of all views; `None` if labels are not decided by votes. Nothing may be in flight.
    pub(in crate::train) fn count(&self, context: &mut Context) -> Result<Option<Decision>> {
        if !Self::decide(context) {
            return Ok(None);
        }
        context.refresh_poses()?;
        let Context { engine, config, views, objects_only, .. } = context;
        let how = Sweep { labelled_only: *objects_only, ..Sweep::new(config.near, config.mask_border) };
        let (means, voters) = (engine.means()?, views.voters());
        // Masks that disagree with the model's labels have less weight.
        let is_judged = self.have_labelled;
        let mut decision = decide::count(engine, &voters, is_judged, &means, how)?;
        let trained = engine.trained_count() as usize;
        if trained < decision.labels.len() {
            // The views of a region know little about frozen Gaussians.
            decision.labels[trained..].copy_from_slice(&engine.labels()?[trained..]);
        }
        Ok(Some(decision))
    }
}

impl StepJob<Context> for VoteJob {
    fn is_due(&self, step: u32, context: &Context) -> bool {
        Self::decide(context) && context.config.counts_votes_at(step) && !context.blurs_depth_before(step)
    }

    fn run(&mut self, _step: u32, context: &mut Context) -> Result<()> {
        if let Some(decision) = self.count(context)? {
            context.engine.set_labels(&decision.labels)?;
            self.have_labelled = true;
        }
        Ok(())
    }
}
