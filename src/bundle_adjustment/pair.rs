//! Compares a patch with another photo.

use super::Frame;
use super::patch::{PATCH_CENTRE, PATCH_PIXELS, Patch, without_mean};
use crate::scene::Camera;
use glam::{DMat3, DQuat, DVec2, DVec3};

/// Parameters of a pose: rotation and translation in camera space.
pub(super) const POSE_PARAMETERS: usize = 6;
/// Parameters of a comparison: pose of the other photo, pose of the patch's own photo, logarithm of the patch depth.
pub(super) const COMPARISON_PARAMETERS: usize = 2 * POSE_PARAMETERS + 1;
/// Most partner photos per photo.
const PARTNERS_MAX: usize = 12;
/// Smallest cosine of the angle between the view axes of partners (60 degrees).
const AXES_COSINE_MIN: f64 = 0.5;
/// Smallest share of a photo's patches that a partner must show.
const SHOWN_SHARE_MIN: f64 = 0.25;
/// Number of patches sampled to find partners, approximately.
const SAMPLE_PATCHES: usize = 100;
/// Largest relative difference between a patch's depth and the model's depth at its projection.
const DEPTH_DIFFERENCE_MAX: f64 = 0.03;
/// Smallest correlation between a patch and the pixels at its projection. A higher bound would drop the patches with
/// the largest errors in the first rounds.
const CORRELATION_MIN: f64 = 0.5;
/// Colour difference above which a patch is down-weighted.
const COLOUR_NOISE: f64 = 0.02;

/// Returns a camera after a pose step: a camera-space point y moves to y + w x y + s, for a small rotation w and
/// translation s.
pub(super) fn moved(camera: &Camera, step: &[f64; POSE_PARAMETERS]) -> Camera {
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_slice(&step[..3])));
    let translation = turn * camera.translation + DVec3::from_slice(&step[3..]);
    Camera { rotation: turn * camera.rotation, translation, ..camera.clone() }
}

/// Returns the partner frames of each frame. Partners overlap well and have different baselines: two photos from almost
/// the same place do not determine depth.
pub(super) fn partners(frames: &[Frame], patches: &[Vec<Patch>]) -> Vec<Vec<usize>> {
    let of = |host: usize| {
        let every = patches[host].len().div_ceil(SAMPLE_PATCHES).max(1);
        let sample: Vec<DVec3> = patches[host].iter().step_by(every).map(|patch| patch.places[PATCH_CENTRE]).collect();
        let axis = frames[host].camera.axis();
        let mut found: Vec<(usize, usize)> = Vec::new();
        for (other, frame) in frames.iter().enumerate() {
            if other != host && axis.dot(frame.camera.axis()) > AXES_COSINE_MIN {
                let transform = CameraTransform::new(&frames[host].camera, &frame.camera);
                let shown = sample.iter().filter(|&&place| shows(frame, transform.apply(place))).count();
                found.push((shown, other));
            }
        }
        found.retain(|&(shown, _)| shown > 0 && shown as f64 >= SHOWN_SHARE_MIN * sample.len() as f64);
        found.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        let chosen = found.len().min(PARTNERS_MAX);
        (0..chosen).map(|k| found[k * found.len() / chosen].1).collect()
    };
    (0..frames.len()).map(of).collect()
}

/// Returns true if a frame shows a point of its camera space.
fn shows(frame: &Frame, place: DVec3) -> bool {
    let at = frame.camera.project(place);
    place.z > 0.0 && (frame.depth_at(at.x, at.y) - place.z).abs() <= DEPTH_DIFFERENCE_MAX * place.z
}

/// Transform from one camera space to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraTransform {
    turn: DMat3,
    shift: DVec3,
}

impl CameraTransform {
    pub(super) fn new(from: &Camera, to: &Camera) -> Self {
        let turn = to.rotation * from.rotation.transpose();
        Self { turn, shift: to.translation - turn * from.translation }
    }

    fn apply(&self, place: DVec3) -> DVec3 {
        self.turn * place + self.shift
    }
}

/// The contribution of a comparison to the equations: second moments of the colour gradient, its product with the
/// difference, and the derivatives of the projected position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    /// Of xx, xy and yy, 1 / px^2.
    pub(super) moments: [f64; 3],
    /// Of x and y, 1 / px.
    pub(super) pull: [f64; 2],
    /// Derivatives of x and y, px, by the parameters.
    pub(super) places: [[f64; COMPARISON_PARAMETERS]; 2],
}

/// Compares a patch with a frame. `None` if the frame does not show the patch, `Some(None)` if the pixels do not match.
pub(super) fn compare(transform: &CameraTransform, patch: &Patch, frame: &Frame) -> Option<Option<Comparison>> {
    let middle = transform.apply(patch.places[PATCH_CENTRE]);
    if !shows(frame, middle) {
        return None;
    }
    let (mut colours, mut by_x, mut by_y) =
        ([[0.0; 3]; PATCH_PIXELS], [[0.0; 3]; PATCH_PIXELS], [[0.0; 3]; PATCH_PIXELS]);
    for (k, &place) in patch.places.iter().enumerate() {
        let place = transform.apply(place);
        let at: DVec2 = frame.camera.project(place);
        if place.z <= 0.0 {
            return None;
        }
        [colours[k], by_x[k], by_y[k]] = frame.colours(at.x, at.y)?;
    }
    [&mut colours, &mut by_x, &mut by_y].into_iter().for_each(without_mean);
    let product = |a: &[[f64; 3]; PATCH_PIXELS], b: &[[f64; 3]; PATCH_PIXELS]| -> f64 {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
    };
    let (own, there) = (product(&patch.colours, &patch.colours), product(&colours, &colours));
    if product(&patch.colours, &colours) <= CORRELATION_MIN * (own * there).sqrt() {
        return Some(None);
    }
    // Photos may differ in exposure.
    let gain = (there / own).sqrt();
    let mut difference = patch.colours;
    for (own, there) in difference.as_flattened_mut().iter_mut().zip(colours.as_flattened()) {
        *own = gain * *own - there;
    }
    let count = (3 * PATCH_PIXELS) as f64;
    let square = product(&difference, &difference) / count;
    let weight = 1.0 / (count * (1.0 + square / (COLOUR_NOISE * COLOUR_NOISE)));
    Some(Some(Comparison {
        moments: [product(&by_x, &by_x), product(&by_x, &by_y), product(&by_y, &by_y)].map(|sum| weight * sum),
        pull: [product(&by_x, &difference), product(&by_y, &difference)].map(|sum| weight * sum),
        places: derivatives(transform, &frame.camera, patch.places[PATCH_CENTRE]),
    }))
}

/// Returns the derivatives of a patch's position in the other photo.
fn derivatives(transform: &CameraTransform, other: &Camera, own: DVec3) -> [[f64; COMPARISON_PARAMETERS]; 2] {
    let there = transform.apply(own);
    let mut found = [[0.0; COMPARISON_PARAMETERS]; 2];
    for k in 0..COMPARISON_PARAMETERS {
        let axis = DVec3::AXES[k % 3];
        let d = match k / 3 {
            0 => axis.cross(there),
            1 => axis,
            2 => -(transform.turn * axis.cross(own)),
            3 => -(transform.turn * axis),
            _ => transform.turn * own,
        };
        found[0][k] = other.fx * (d.x - there.x / there.z * d.z) / there.z;
        found[1][k] = other.fy * (d.y - there.y / there.z * d.z) / there.z;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{COMPARISON_PARAMETERS, CameraTransform, POSE_PARAMETERS, derivatives, moved};
    use crate::scene::Camera;
    use glam::{DMat3, DVec3};

    fn camera(turn: f64) -> Camera {
        let (rotation, translation) = (DMat3::from_rotation_y(turn), DVec3::new(0.1, -0.2, 0.3 + turn));
        Camera { rotation, translation, fx: 90.0, fy: 80.0, cx: 50.0, cy: 40.0, width: 100, height: 80 }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (host, other, place) = (camera(0.1), camera(-0.2), DVec3::new(0.4, -0.3, 2.5));
        let at = |numbers: [f64; COMPARISON_PARAMETERS]| {
            let step = |of: &[f64]| -> [f64; POSE_PARAMETERS] { std::array::from_fn(|k| of[k]) };
            let (there, own) = (moved(&other, &step(&numbers)), moved(&host, &step(&numbers[POSE_PARAMETERS..])));
            there.project(CameraTransform::new(&own, &there).apply(place * numbers[COMPARISON_PARAMETERS - 1].exp()))
        };
        let found = derivatives(&CameraTransform::new(&host, &other), &other, place);
        for k in 0..COMPARISON_PARAMETERS {
            let by = |step: f64| at(std::array::from_fn(|of| if of == k { step } else { 0.0 }));
            let expected = (by(1e-5) - by(-1e-5)) / 2e-5;
            let error = (expected.x - found[0][k]).abs().max((expected.y - found[1][k]).abs());
            assert!(error < 1e-6 * (1.0 + expected.length()), "{k}: {expected} and {:?}", found.map(|row| row[k]));
        }
    }
}
