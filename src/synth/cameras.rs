//! The cameras of a scene: on a dome around it, facing inwards, or on a flight over a city.

use super::{Preset, SynthOptions, flight, hash01, turntable};
use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::Camera;
use std::f64::consts::TAU;

/// Distance to the common target of the cameras, world units.
const CAMERA_DISTANCE: f64 = 4.0;
/// Elevations of the three rings, degrees.
const RING_ELEVATIONS: [f64; 3] = [16.0, 33.0, 52.0];

/// Returns one camera per view.
pub fn cameras(options: &SynthOptions) -> Vec<Camera> {
    match options.preset {
        Preset::City => (0..options.views).map(|view| looking(options, flight::pose(options, view))).collect(),
        _ if turntable::is_turned(options.preset) => {
            (0..options.views).map(|view| turntable::camera(options, view)).collect()
        }
        _ => ring_of_cameras(options),
    }
}

/// Returns one camera per view, once around the scene. Every third camera has the same height, so that a held-out view
/// has close neighbours.
pub fn ring_of_cameras(options: &SynthOptions) -> Vec<Camera> {
    (0..options.views).map(|view| looking(options, on_ring(options, view))).collect()
}

/// Returns the position of a view and the unit vector along its optical axis.
fn on_ring(options: &SynthOptions, view: u32) -> (DVec3, DVec3) {
    let random = |what: u64| hash01(options.seed, 3, u64::from(view), what) - 0.5;
    let azimuth = TAU * (f64::from(view) + 0.3 * random(0)) / f64::from(options.views);
    let elevation = (RING_ELEVATIONS[(view % 3) as usize] + 4.0 * random(1)).to_radians();
    let target = DVec3::new(0.1 * random(2), 0.1 * random(3), 0.42);
    let outward = DVec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
    (target + outward * (CAMERA_DISTANCE * (1.0 + 0.1 * random(4))), -outward)
}

pub(super) fn looking(options: &SynthOptions, (centre, forward): (DVec3, DVec3)) -> Camera {
    let right = forward.cross(DVec3::Z).normalize();
    let down = forward.cross(right);
    // Round through the quaternion, because the files store that.
    let rotation = DMat3::from_quat(DQuat::from_mat3(&DMat3::from_cols(right, down, forward).transpose()).normalize());
    let (width, height) = (f64::from(options.width), f64::from(options.height));
    let focal = 1.08 * width.min(height * 4.0 / 3.0);
    Camera {
        rotation,
        translation: -(rotation * centre),
        fx: focal,
        fy: focal,
        cx: width / 2.0,
        cy: height / 2.0,
        width: options.width,
        height: options.height,
    }
}
