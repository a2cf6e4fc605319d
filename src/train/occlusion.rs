//! Occluders of the objects in each view: given before the first step, or from the rendered depth of the model at
//! intervals.

use super::{Occlusion, Trainer};
use crate::error::Result;
use crate::label::occlusion::{Rule, by_contour};
use crate::render::{RenderOptions, render};
use crate::scene::Occluders;
use std::collections::BTreeMap;

impl Trainer {
    /// Sets the occluders by name of the view. Drops ids without pixels in the mask of the view. Returns the names of
    /// views with masks that `found` lacks; their objects count as not hidden.
    pub fn set_occluders(&mut self, found: &BTreeMap<String, Occluders>) -> Vec<String> {
        let mut without = Vec::new();
        for view in self.views.iter_mut().filter(|view| view.mask.is_some()) {
            let shown = |label: &u16| view.objects.binary_search(label).is_ok();
            match found.get(&view.name) {
                Some(lists) => {
                    let lists = lists.iter().filter(|(label, _)| shown(label));
                    let kept = |by: &Vec<u16>| by.iter().copied().filter(|label| *label == 0 || shown(label)).collect();
                    view.occluders = lists.map(|(&label, by)| (label, kept(by))).collect();
                }
                None => without.push(view.name.clone()),
            }
        }
        without
    }

    /// Returns the occluders of the last step, by name of the view. Every object of a view has an entry.
    pub fn occluders(&self) -> BTreeMap<String, Occluders> {
        let with_masks = self.views.iter().filter(|view| view.mask.is_some());
        let lists = with_masks.map(|view| {
            let list = |&label: &u16| (label, view.occluders.get(&label).cloned().unwrap_or_default());
            (view.name.clone(), view.objects.iter().map(list).collect())
        });
        lists.collect()
    }

    /// Returns true before the steps at which the occluders are updated.
    pub(super) fn refreshes_occluders(&self, step: u32) -> bool {
        let config = &self.config;
        self.engine.size().labels.is_some()
            && config.layer_every() > 0
            && config.occlusion == Occlusion::Rendered
            && config.updates_occluders_at(step)
            && !self.blurs_depth_before(step)
    }

    /// Updates the occluders from the rendered depth of every view with masks. Nothing may be in flight.
    pub fn refresh_occluders(&mut self) -> Result<()> {
        let options = RenderOptions::of_depth(self.config.near);
        self.refresh_poses()?;
        for index in 0..self.views.len() {
            let Some(mask) = &self.views[index].mask else { continue };
            let rendered = render(&mut self.engine, self.views.camera(index), &options)?;
            let found = by_contour(&*mask.get()?, &rendered.mean_depth()?, Rule::default());
            self.views[index].occluders = found;
        }
        Ok(())
    }
}
