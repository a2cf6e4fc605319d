//! A lens with its focal lengths, principal point and image size.

use super::Lens;
use glam::{DVec2, DVec3};
use labelgs_scene::Camera;
use std::f64::consts::FRAC_PI_2;

/// A camera with its lens: the intrinsics of [`Camera`] are those of the lens's image plane.
#[derive(Clone, Debug)]
pub struct Optics {
    /// Pose, intrinsics and size of the photo.
    pub camera: Camera,
    /// The lens.
    pub lens: Lens,
    /// Largest angle from the axis that the lens covers, radians, and its cosine.
    reach: f64,
    cos_reach: f64,
}

impl Optics {
    /// Combines a camera and its lens.
    pub fn new(camera: Camera, lens: Lens) -> Self {
        let reach = lens.projection().map_or(FRAC_PI_2, |lens| lens.reach());
        Self { camera, lens, reach, cos_reach: reach.cos() }
    }

    /// Returns the largest angle from the axis that the lens covers, radians.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Returns the position in the photo, px, of a direction in camera axes; `None` if the lens does not cover it. The
    /// position may lie outside the photo.
    pub fn pixel(&self, direction: DVec3) -> Option<DVec2> {
        let Camera { fx, fy, cx, cy, .. } = self.camera;
        let Some(lens) = self.lens.projection() else {
            return (direction.z > 0.0).then(|| self.camera.project(direction));
        };
        if direction.z < self.cos_reach * direction.length() {
            return None;
        }
        let at = lens.project(direction);
        Some(DVec2::new(fx * at.x + cx, fy * at.y + cy)).filter(|at| at.is_finite())
    }

    /// Returns the unit direction in camera axes of a position in the photo, px; `None` outside the lens.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let Camera { fx, fy, cx, cy, .. } = self.camera;
        let point = DVec2::new((pixel.x - cx) / fx, (pixel.y - cy) / fy);
        match self.lens.projection() {
            None => Some(point.extend(1.0).normalize()),
            Some(lens) => lens.unproject(point, self.reach),
        }
    }

    /// Returns true if a position, px, is inside the photo.
    pub fn holds(&self, pixel: DVec2) -> bool {
        // By rounding, the seam of a panorama is its last or its first pixel.
        let inside = |at: f64, side: u32| (-1e-9..f64::from(side) + 1e-9).contains(&at);
        inside(pixel.x, self.camera.width) && inside(pixel.y, self.camera.height)
    }
}
