//! What the cameras of a scene look at together.

use super::Camera;
use glam::{DMat3, DVec3};

/// Where to look at a scene from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overview {
    /// Direction of up in the world, of length 1.
    pub up: DVec3,
    /// The point in the middle, world units.
    pub target: DVec3,
    /// Distance of the cameras from it, world units.
    pub distance: f64,
}

impl Overview {
    /// Returns the mean up of some cameras, the point that they look at, and their mean distance from it; none without
    /// cameras.
    pub fn of<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> Option<Self> {
        let count = cameras.clone().count();
        if count == 0 {
            return None;
        }
        let up = -cameras.clone().map(|camera| camera.rotation.row(1)).sum::<DVec3>();
        let middle = cameras.clone().map(Camera::centre).sum::<DVec3>() / count as f64;
        // Held near the cameras where their axes are parallel.
        let (matrix, right) = nearest_to_axes(cameras.clone());
        let target = (matrix + DMat3::IDENTITY * 1e-3).inverse() * (right + middle * 1e-3);
        let distance = cameras.map(|camera| camera.centre().distance(target)).sum::<f64>() / count as f64;
        Some(Self { up: up.try_normalize().unwrap_or(DVec3::NEG_Y), target, distance: distance.max(1e-6) })
    }
}

/// Returns matrix and right side of the equations for the point with the least sum of squared distances to the optical axes.
pub fn nearest_to_axes<'a>(cameras: impl Iterator<Item = &'a Camera>) -> (DMat3, DVec3) {
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for camera in cameras {
        let axis = camera.axis();
        let across = DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        matrix += across;
        right += across * camera.centre();
    }
    (matrix, right)
}
