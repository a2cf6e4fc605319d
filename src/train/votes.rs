//! Labels by votes, counted over all training views at intervals and at the end.

use super::{LabelRule, Trainer};
use crate::error::Result;
use crate::label::vote::ballot::Sweep;
use crate::label::vote::decide::{self, Decision};
use crate::scene::Gaussians;

impl Trainer {
    fn votes(&self) -> bool {
        self.engine.size().labels.is_some() && self.config.label_rule == LabelRule::Votes
    }

    pub(super) fn counts_votes(&self, step: u32) -> bool {
        self.votes() && self.config.counts_votes_at(step) && !self.blurs_depth_before(step)
    }

    /// Counts the votes of all views and writes the labels to the device. Nothing may be in flight.
    pub fn refresh_labels(&mut self) -> Result<()> {
        let decision = self.count_votes()?;
        self.engine.set_labels(&decision.labels)?;
        self.labelled_once = true;
        Ok(())
    }

    /// Returns true if the Gaussians on the device have labels: in a scene with masks.
    pub fn has_labels(&self) -> bool {
        self.engine.size().labels.is_some()
    }

    fn count_votes(&mut self) -> Result<Decision> {
        let how = Sweep::new(self.config.near, self.config.mask_border);
        let means = self.engine.means()?;
        self.refresh_poses()?;
        let voters = self.views.voters();
        // Masks that disagree with the labels of the model have less weight.
        let is_judged = self.labelled_once;
        let mut decision = decide::count(&mut self.engine, &voters, is_judged, &means, how)?;
        let trained = self.engine.trained_count() as usize;
        if trained < decision.labels.len() {
            // The views of a part of a scene know little of what is frozen.
            decision.labels[trained..].copy_from_slice(&self.engine.labels()?[trained..]);
        }
        Ok(decision)
    }

    /// Returns the model with its final labels. With [`LabelRule::Votes`](super::LabelRule::Votes) it counts them again
    /// and sets the confidence.
    pub fn labelled_model(&mut self) -> Result<Gaussians> {
        self.drain()?;
        let decision = if self.votes() { Some(self.count_votes()?) } else { None };
        let mut model = self.model()?;
        if let Some(decision) = decision {
            decide::apply(&mut model, decision);
        }
        Ok(model)
    }
}
