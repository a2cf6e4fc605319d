//! The frame of the ground, and the boxes of the blocks in it.

use crate::records::block_file::Bounds;
use crate::scene::{Camera, Gaussians, Overview, Zone};
use glam::DVec3;

/// Radius around the cameras beyond which nothing is trained in blocks, scene extents: less than that of the first far
/// Gaussians, which stand for the sky.
const FAR_RADIUS_EXTENTS: f64 = 2.0;

/// Axes of the ground, and the sphere of what is near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// Unit vectors, world: two along the ground, and up.
    pub axes: [DVec3; 3],
    /// Middle of the cameras, world position.
    pub centre: DVec3,
    /// Radius of what is near, world units.
    pub far: f64,
}

impl Frame {
    /// Finds the frame of some cameras. `up` is that of the world, if it is known.
    pub(super) fn from_cameras(cameras: &[&Camera], extent: f64, up: Option<DVec3>) -> Self {
        let seen = Overview::of(cameras.iter().copied()).map(|overview| overview.up);
        let up = up.or(seen).and_then(DVec3::try_normalize).unwrap_or(DVec3::Z);
        // An up near an axis of the world keeps the other axes of the world.
        let aside = [DVec3::X, DVec3::Y].into_iter().find(|axis| axis.dot(up).abs() < 0.75).unwrap_or(DVec3::X);
        let first = (aside - up * aside.dot(up)).normalize();
        let centre = cameras.iter().map(|camera| camera.centre()).sum::<DVec3>() / cameras.len().max(1) as f64;
        Self { axes: [first, up.cross(first), up], centre, far: FAR_RADIUS_EXTENTS * extent }
    }

    /// Returns a world point along the axes.
    pub(super) fn place(&self, world: DVec3) -> DVec3 {
        self.zone(&Bounds::ALL).place(world)
    }

    pub(super) fn zone(&self, bounds: &Bounds) -> Zone {
        bounds.zone(self.axes.map(|axis| axis.to_array()))
    }

    /// Returns the places of the Gaussians that are near, with their rows.
    pub(super) fn near(&self, model: &Gaussians) -> Vec<(usize, DVec3)> {
        let rows = (0..model.len()).map(|row| (row, model.world(row)));
        rows.filter(|(_, at)| at.distance(self.centre) <= self.far).map(|(row, at)| (row, self.place(at))).collect()
    }
}
