//! What the shared rows of the photos say in the middle of a training: exposures and poses.

use super::adjust::{self, Frame, adjusted};
use super::{Parameter, Trainer, exposure, poses};
use crate::error::Result;
use crate::render::{RenderOptions, render};
use crate::scene::{Camera, ColourMatrix};
use std::collections::BTreeMap;

impl Trainer {
    /// Returns the matrix of colours of each training photo, by name; none without exposure. Nothing may be in flight.
    pub fn exposures(&mut self) -> Result<BTreeMap<String, ColourMatrix>> {
        let rows = self.photo_rows(exposure::NAME)?;
        let matrices = rows.iter().map(|of| exposure::matrix_of(of));
        Ok(self.views.iter().map(|view| view.name.clone()).zip(matrices).collect())
    }

    /// Returns the refined camera of each training view, by name; none without refinement. Nothing may be in flight.
    pub fn poses(&mut self) -> Result<BTreeMap<String, Camera>> {
        self.refresh_poses()?;
        let refined = self.views.refined().iter().cloned();
        Ok(self.views.iter().map(|view| view.name.clone()).zip(refined).collect())
    }

    /// Returns the rows of each photo that belong to an owner of shared parameters; none without the owner.
    fn photo_rows(&mut self, owner: &str) -> Result<Vec<Vec<[f32; 4]>>> {
        let Some(range) = self.shared.photo_rows(owner) else { return Ok(Vec::new()) };
        let rows = self.engine.shared()?;
        let of = |view: usize| rows[self.shared.of_view(view)][range.clone()].to_vec();
        Ok((0..self.views.len()).map(of).collect())
    }

    /// Takes over the refined poses, for work between steps. Nothing may be in flight.
    pub(super) fn refresh_poses(&mut self) -> Result<()> {
        let rows = self.photo_rows(poses::NAME)?;
        self.views.refine(&rows);
        Ok(())
    }

    /// Returns true before the steps at which poses are adjusted by a comparison of the photos.
    pub(super) fn adjusts_poses(&self, step: u32) -> bool {
        // A finished model tells the poses itself.
        self.objective.trains(Parameter::Positions)
            && self.shared.photo_rows(poses::NAME).is_some()
            && poses::are_compared_before(self.at(step))
            && !self.blurs_depth_before(step)
    }

    /// Adjusts the poses of all photos by a comparison of these. Nothing may be in flight.
    pub(super) fn adjust_poses(&mut self) -> Result<()> {
        let Some(range) = self.shared.photo_rows(poses::NAME) else { return Ok(()) };
        if self.views.len() > adjust::MOST {
            tracing::warn!("the model alone tells the poses of more than {} photos", adjust::MOST);
            return Ok(());
        }
        self.refresh_poses()?;
        let options = RenderOptions::of_depth(self.config.near);
        let mut frames = Vec::with_capacity(self.views.len());
        for index in 0..self.views.len() {
            let camera = Frame::camera_of(self.views.camera(index), self.views.len());
            let model = render(&mut self.engine, &camera, &options)?;
            frames.push(Frame::new(camera, &*self.views[index].photo.get()?, &model));
        }
        let found = adjusted(frames);
        let mut rows = self.engine.shared()?;
        let mut unknown = Vec::new();
        for (index, found) in found.iter().enumerate() {
            let (view, of_view) = (&self.views[index], &mut rows[self.shared.of_view(index)][range.clone()]);
            if found.as_ref().and_then(|found| poses::settle(of_view, &view.camera, found)).is_none() {
                unknown.push(view.name.as_str());
            }
        }
        let (count, all) = (found.len() - unknown.len(), found.len());
        tracing::info!("poses of {count} of {all} photos adjusted by a comparison of the photos");
        if !unknown.is_empty() {
            tracing::debug!("poses by the model alone: {}", unknown.join(", "));
        }
        if count > 0 {
            self.engine.set_shared(&rows)?;
            self.refresh_poses()?;
        }
        Ok(())
    }
}
