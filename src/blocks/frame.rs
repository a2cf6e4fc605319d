//! The ground frame, and the block boxes in it.

use crate::records::block_file::Bounds;
use crate::scene::{Camera, Gaussians, Overview, Zone};
use glam::DVec3;

/// Radius around the cameras beyond which Gaussians belong to no block, scene extents. It is smaller than the distance
/// of the initial sky Gaussians.
const FAR_RADIUS_EXTENTS: f64 = 2.0;

/// Axes of the ground, and a sphere around the near part of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// Unit vectors, world: two along the ground, and up.
    pub axes: [DVec3; 3],
    /// Mean camera position, world units.
    pub centre: DVec3,
    /// Radius of the near sphere, world units.
    pub far: f64,
}

impl Frame {
    /// Fits the frame to cameras. `up` is the world's up direction, if known.
    pub(super) fn from_cameras(cameras: &[&Camera], extent: f64, up: Option<DVec3>) -> Self {
        let seen = Overview::from_cameras(cameras.iter().copied()).map(|overview| overview.up);
        let up = up.or(seen).and_then(DVec3::try_normalize).unwrap_or(DVec3::Z);
        // If up is close to a world axis, the other world axes are kept.
        let aside = [DVec3::X, DVec3::Y].into_iter().find(|axis| axis.dot(up).abs() < 0.75).unwrap_or(DVec3::X);
        let first = (aside - up * aside.dot(up)).normalize();
        let centre = cameras.iter().map(|camera| camera.centre()).sum::<DVec3>() / cameras.len().max(1) as f64;
        Self { axes: [first, up.cross(first), up], centre, far: FAR_RADIUS_EXTENTS * extent }
    }

    /// Converts a world point to the ground frame.
    pub(super) fn place(&self, world: DVec3) -> DVec3 {
        self.zone(&Bounds::ALL).to_axes(world)
    }

    pub(super) fn zone(&self, bounds: &Bounds) -> Zone {
        bounds.zone(self.axes.map(|axis| axis.to_array()))
    }

    /// Returns the rows and ground-frame positions of the near Gaussians.
    pub(super) fn near_gaussians(&self, model: &Gaussians) -> Vec<(usize, DVec3)> {
        let rows = (0..model.len()).map(|row| (row, model.world(row)));
        rows.filter(|(_, at)| at.distance(self.centre) <= self.far).map(|(row, at)| (row, self.place(at))).collect()
    }
}
