//! Chooses the near plane of a scene.

use crate::scene::{Camera, Gaussians};
use glam::DVec3;

pub(crate) use crate::render::NEAR_DEFAULT;

/// Near plane of a small scene, as a share of the median depth of its Gaussians.
const NEAR_DEPTH_SHARE: f64 = 0.05;
/// Most cameras in the sample, evenly chosen.
const SAMPLE_CAMERAS_MAX: usize = 64;
/// Most Gaussians in the sample, evenly chosen.
const SAMPLE_GAUSSIANS_MAX: usize = 4096;

/// Returns the positions of at most `most` Gaussians, evenly chosen.
pub(in crate::train) fn sample(model: &Gaussians, most: usize) -> Vec<DVec3> {
    (0..model.len()).step_by(model.len().div_ceil(most).max(1)).map(|row| model.world(row)).collect()
}

/// Returns the depths of the positions that a camera sees.
pub(in crate::train) fn seen_depths(camera: &Camera, places: &[DVec3]) -> Vec<f64> {
    let is_seen = |place: &DVec3| {
        let at = camera.project(*place);
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        place.z > 0.0 && (0.0..=width).contains(&at.x) && (0.0..=height).contains(&at.y)
    };
    places.iter().map(|&world| camera.to_camera(world)).filter(is_seen).map(|place| place.z).collect()
}

/// Returns [`NEAR_DEFAULT`], or [`NEAR_DEPTH_SHARE`] times the median depth of the initial Gaussians in the training
/// cameras if that is less.
pub(crate) fn near_plane<'a>(cameras: impl ExactSizeIterator<Item = &'a Camera>, model: &Gaussians) -> f32 {
    let (rows, every) = (sample(model, SAMPLE_GAUSSIANS_MAX), cameras.len().div_ceil(SAMPLE_CAMERAS_MAX).max(1));
    let mut depths: Vec<f64> = cameras.step_by(every).flat_map(|camera| seen_depths(camera, &rows)).collect();
    if depths.is_empty() {
        return NEAR_DEFAULT;
    }
    let middle = depths.len() / 2;
    let median = *depths.select_nth_unstable_by(middle, f64::total_cmp).1;
    // The projection divides by the near plane.
    NEAR_DEFAULT.min((NEAR_DEPTH_SHARE * median) as f32).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn small_scenes_come_nearer() {
        let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
        let camera = Camera { rotation, translation, fx: 100.0, fy: 100.0, cx: 32.0, cy: 32.0, width: 64, height: 64 };
        let at = |depth: f32| Gaussians { means: vec![[0.0, 0.0, depth]; 9], ..Gaussians::default() };
        let near = |model: &Gaussians| near_plane(std::iter::once(&camera), model);
        assert_eq!(near(&at(10.0)), NEAR_DEFAULT);
        assert!((near(&at(1e-3)) - 5e-5).abs() < 1e-9);
        assert_eq!(near(&at(-1.0)), NEAR_DEFAULT, "nothing is before the camera");
        let far = DVec3::new(0.0, 0.0, 5e6);
        let moved = Gaussians { origin: far, ..at(1e-3) };
        let away = camera.relative_to(-far);
        assert!((near_plane(std::iter::once(&away), &moved) - 5e-5).abs() < 1e-6, "far from the origin too");
    }
}
