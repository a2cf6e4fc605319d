//! The current results of a training: model, labels, occluders, exposures and poses.

use super::Trainer;
use crate::error::Result;
use crate::label::vote::decide;
use crate::scene::{Camera, ColourMatrix, Gaussians, Occluders};
use crate::train::between::StepJob;
use crate::train::shared::exposure;
use std::collections::BTreeMap;

impl Trainer {
    /// Reads the model back. Steps that failed for lack of memory did not change it.
    pub fn model(&mut self) -> Result<Gaussians> {
        if let Err(error) = self.drain() {
            if !error.is_out_of_memory() {
                return Err(error);
            }
            self.in_flight.clear();
            self.context.engine.abandon()?;
        }
        self.context.engine.download_model()
    }

    /// Returns the model with its final labels. With [`LabelRule::Votes`](crate::train::LabelRule::Votes) it counts
    /// votes again and sets the confidence.
    pub fn labelled_model(&mut self) -> Result<Gaussians> {
        self.drain()?;
        let decision = self.jobs.votes.count(&mut self.context)?;
        let mut model = self.model()?;
        if let Some(decision) = decision {
            decide::apply(&mut model, decision);
        }
        Ok(model)
    }

    /// Returns true if the Gaussians on the device have labels: in a scene with masks.
    pub fn has_labels(&self) -> bool {
        self.context.has_labels()
    }

    /// Counts the votes of all views and writes the labels to the device. Nothing may be in flight.
    pub fn refresh_labels(&mut self) -> Result<()> {
        self.jobs.votes.run(self.step, &mut self.context)
    }

    /// Updates the occluders from the rendered depth of every view with masks. Nothing may be in flight.
    pub fn refresh_occluders(&mut self) -> Result<()> {
        self.jobs.occluders.run(self.step, &mut self.context)
    }

    /// Sets the occluders by name of the view. Drops ids without pixels in the mask of the view. Returns the names of
    /// views with masks that `found` lacks; their objects are assumed not to be hidden.
    pub fn set_occluders(&mut self, found: &BTreeMap<String, Occluders>) -> Vec<String> {
        let mut without = Vec::new();
        for view in self.context.views.iter_mut().filter(|view| view.mask.is_some()) {
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
        let with_masks = self.context.views.iter().filter(|view| view.mask.is_some());
        let lists = with_masks.map(|view| {
            let list = |&label: &u16| (label, view.occluders.get(&label).cloned().unwrap_or_default());
            (view.name.clone(), view.objects.iter().map(list).collect())
        });
        lists.collect()
    }

    /// Returns the exposure matrix of each training photo, by name; empty without exposure. Nothing may be in flight.
    pub fn exposures(&mut self) -> Result<BTreeMap<String, ColourMatrix>> {
        let rows = self.context.photo_rows(exposure::EXPOSURE_NAME)?;
        let matrices = rows.iter().map(|of| exposure::matrix_of(of));
        Ok(self.names().zip(matrices).collect())
    }

    /// Returns the refined camera of each training view, by name; empty without refinement. Nothing may be in flight.
    pub fn poses(&mut self) -> Result<BTreeMap<String, Camera>> {
        self.context.refresh_poses()?;
        let refined = self.context.views.refined().iter().cloned();
        Ok(self.names().zip(refined).collect())
    }

    fn names(&self) -> impl Iterator<Item = String> {
        self.context.views.iter().map(|view| view.name.clone())
    }
}
