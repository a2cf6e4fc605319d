//! What the shared rows of the photos say in the middle of a training: exposures and poses.

use super::{Trainer, exposure, poses};
use crate::error::Result;
use crate::scene::Camera;
use std::collections::BTreeMap;

impl Trainer {
    /// Returns the gains of each training photo, r, g, b, by name; none without exposure. Nothing may be in flight.
    pub fn exposures(&mut self) -> Result<BTreeMap<String, [f32; 3]>> {
        let rows = self.photo_rows(exposure::NAME)?;
        let gains = rows.iter().map(|of| [0, 1, 2].map(|channel| of[0][channel].exp()));
        Ok(self.views.iter().map(|view| view.name.clone()).zip(gains).collect())
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
}
