//! Labels by votes, counted over all training views every so often and at the end.

use super::{LabelRule, Trainer};
use crate::error::Result;
use crate::infer::ballot::{Sweep, Voter, sweep};
use crate::infer::decide::{Decision, decide, trust};
use crate::infer::render::render;
use crate::plan::Buf;
use crate::scene::{Gaussians, LabelMap};
use std::collections::BTreeMap;

impl Trainer {
    fn votes(&self) -> bool {
        self.engine.room().labels.is_some() && self.config.label_rule == LabelRule::Votes
    }

    /// True before the steps at which votes are counted.
    pub(super) fn counts_votes(&self, step: u32) -> bool {
        let config = &self.config;
        self.votes()
            && step >= config.label_from
            && (step - config.label_from).is_multiple_of(config.vote_every)
            // Right after an opacity reset nothing tells what is in front.
            && !(step > 1 && config.resets_opacity_at(step - 1))
    }

    /// Counts the votes of all views and gives the labels to the device; nothing may be in flight.
    pub(super) fn count_votes(&mut self) -> Result<Decision> {
        let how = Sweep { near: self.config.near, border: self.config.mask_border };
        let count = self.engine.gaussian_count() as usize;
        let rows = self.engine.sched_mut().download::<[f32; 4]>(Buf::MEANS, 0, 0, count)?;
        let means: Vec<[f32; 3]> = rows.iter().map(|&[x, y, z, _]| [x, y, z]).collect();
        let trusts: Vec<Option<BTreeMap<u16, f32>>> =
            if self.config.vote_trust && self.labelled_once { self.trusts()? } else { vec![None; self.views.len()] };
        let voters = self.views.iter().zip(&trusts).filter_map(|(view, trust)| {
            let (mask, trust) = (view.mask.as_ref()?, trust.as_ref());
            Some(Voter { camera: &view.camera, mask, photo: Some(&view.photo), trust })
        });
        let voters: Vec<Voter> = voters.collect();
        let ballot = sweep(&mut self.engine, &voters, how)?;
        let decision = decide(&ballot, &means, true)?;
        self.engine.sched_mut().upload(Buf::LABELS, 0, 0, &decision.labels)?;
        self.labelled_once = true;
        Ok(decision)
    }

    /// How far each view's mask agrees with the labels that the Gaussians have now.
    fn trusts(&mut self) -> Result<Vec<Option<BTreeMap<u16, f32>>>> {
        let count = self.engine.gaussian_count() as usize;
        let labels = self.engine.sched_mut().download::<u32>(Buf::LABELS, 0, 0, count)?;
        let (near, background) = (self.config.near, self.config.background);
        let mut all = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let Some(mask) = &view.mask else {
                all.push(None);
                continue;
            };
            let shown: LabelMap = render(&mut self.engine, &view.camera, near, background, 0)?.label_map(&labels);
            all.push(Some(trust(mask, &shown)));
        }
        Ok(all)
    }

    /// The model with its final labels: where votes decide they are counted again, and confidence is known.
    pub fn labelled_model(&mut self) -> Result<Gaussians> {
        self.drain()?;
        let decision = if self.votes() { Some(self.count_votes()?) } else { None };
        let mut model = self.model()?;
        model.label_confidence = decision.map(|decision| decision.confidence);
        Ok(model)
    }
}
