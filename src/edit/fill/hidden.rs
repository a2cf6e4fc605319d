//! Gaussians that stay when an object is removed, though nothing but the object was ever seen where they are: no photo
//! has shaped their colours.

use super::evidence::{Evidence, State};
use super::{Place, Sight};
use glam::DVec3;
use labelgs_scene::Gaussians;
use labelgs_scene::gaussians::axes_of;
use rayon::prelude::*;

/// Distance from its centre, in standard deviations, at which a Gaussian must be hidden too: its rim is still seen
/// there.
const RIM_DEVIATIONS: f64 = 1.5;

impl Place {
    /// Returns for each row of `model`, in which the objects `removed` are missing, whether the objects hide it in all
    /// views.
    pub(super) fn hidden(&self, model: &Gaussians, removed: &[u32], sights: &[Sight]) -> Vec<bool> {
        let is_hole = |world: DVec3| {
            let mut evidence = Evidence::default();
            sights.iter().for_each(|sight| evidence.add_point(world, self.cell, removed, sight));
            evidence.state() == State::Hole
        };
        let is_hidden = |row: usize| {
            let world = model.world(row);
            if !model.is_finite(row) || !self.is_near(world, self.ring) || !is_hole(world) {
                return false;
            }
            let turn = axes_of(model.quats[row]);
            let arm = |axis: usize| RIM_DEVIATIONS * f64::from(model.scales[row][axis]).exp() * turn.col(axis);
            (0..3).map(arm).all(|arm| is_hole(world + arm) && is_hole(world - arm))
        };
        (0..model.len()).into_par_iter().map(is_hidden).collect()
    }
}
