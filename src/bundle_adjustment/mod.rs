//! Bundle adjustment of poses by comparing photos with each other.
//!
//! The gradient of the photo loss moves a camera until the render fits its photo. Renders are slightly biased: in a
//! ring of cameras, exact poses all turn down by up to half a pixel. The likely cause is that front splats occlude
//! parts of those behind, so slanted surfaces appear farther away. Comparing photos with each other avoids this bias,
//! and needs only depths from the model. As in direct sparse odometry (Engel et al. 2018), small patches of a photo are
//! projected into other photos by pose and patch depth. Gauss-Newton then minimises the colour differences over all
//! poses and depths, with the depths eliminated.
//!
//! A [`Frame`] is a photo with model depths; a [`Patch`](patch::Patch) is a few of its pixels. [`pair`] compares a
//! patch with another frame, [`system`] sums the equations of all patches, and [`adjusted`] iterates, coarse to fine.

mod frame;
mod pair;
mod patch;
mod system;

pub(crate) use frame::Frame;
pub(crate) use system::solve;

use crate::scene::Camera;
use crate::stage::Stage;
use patch::Patch;
use system::{Counts, FrameEquations, System};

/// Most photos: the equations of more photos take gigabytes.
pub(crate) const PHOTOS_MAX: usize = 1000;
/// Photos are halved until their longer side has at most this many pixels. Smaller photos have too few patches.
const COARSEST_SIDE_MAX: u32 = 400;
/// Largest number of iterations at each size.
const ROUNDS_MAX: usize = 16;
/// Converged if the root mean square rotation of an iteration is below this, radians.
const TURN_MIN: f64 = 5e-5;
/// A photo with fewer matching patches keeps its pose. Photos of 160 px have only 200 to 350 and oscillate by a tenth
/// of a degree; photos of 320 px have 2,000.
const MATCHES_MIN: usize = 400;
/// A photo with a smaller share of matching comparisons keeps its pose: it is off by more than a patch.
const PHOTO_MATCHES_MIN: f64 = 0.4;
/// All poses stay if a smaller share of all comparisons matches. With reflections, motion or sub-pixel detail, the
/// result would be worse than a good reconstruction. A synthetic scene has 0.85, a capture of 260 px with fine detail
/// 0.5.
const ALL_MATCHES_MIN: f64 = 0.7;
/// All poses stay if fewer than this share of the initial comparisons remain possible: the poses have drifted off the
/// model, whose surfaces then hide patches. A synthetic scene has 0.94 or more. A capture of smooth objects has 0.68,
/// because it hardly constrains a common bend of the cameras.
const COMPARABLE_MIN: f64 = 0.85;

/// Returns the adjusted camera of each frame; `None` for a frame that shares too little with others, and for all frames
/// if they agree too little.
pub(crate) fn adjusted(frames: Vec<Frame>) -> Vec<Option<Camera>> {
    let _stage = Stage::new("comparing photos for their poses", 0);
    let mut sizes = vec![frames];
    while let Some(smaller) = sizes.last().filter(|of| of.iter().any(|frame| frame.side() > COARSEST_SIDE_MAX)) {
        let smaller = smaller.iter().map(Frame::halved).collect();
        sizes.push(smaller);
    }
    let mut found: Vec<Camera> = sizes[0].iter().map(|frame| frame.camera.clone()).collect();
    let mut is_known = vec![false; found.len()];
    for frames in sizes.iter_mut().rev() {
        frames.iter_mut().zip(&found).for_each(|(frame, found)| take_pose(&mut frame.camera, found));
        is_known = solved(frames);
        if is_known.contains(&true) {
            found.iter_mut().zip(&*frames).for_each(|(found, frame)| take_pose(found, &frame.camera));
        }
    }
    found.into_iter().zip(is_known).map(|(camera, is_known)| is_known.then_some(camera)).collect()
}

fn take_pose(to: &mut Camera, from: &Camera) {
    (to.rotation, to.translation) = (from.rotation, from.translation);
}

/// Adjusts the cameras of frames of one size. Returns which of them are known.
fn solved(frames: &mut [Frame]) -> Vec<bool> {
    let mut patches: Vec<Vec<Patch>> = frames.iter().map(patch::frame_patches).collect();
    let partners = pair::partners(frames, &patches);
    let mut is_known = vec![false; frames.len()];
    let (mut before, mut last) = (Counts::default(), Counts::default());
    for round in 0..ROUNDS_MAX {
        let sums: Vec<FrameEquations> = system::sums(frames, &patches, &partners);
        let system = System::from_frame_equations(&sums, &partners, frames.len());
        let is_told: Vec<bool> = system.counts.iter().map(|counts| counts.matching >= MATCHES_MIN).collect();
        let is_found = |counts: &Counts| counts.matching as f64 >= PHOTO_MATCHES_MIN * counts.compared as f64;
        is_known = system.counts.iter().zip(&is_told).map(|(counts, is_told)| *is_told && is_found(counts)).collect();
        let all = system.counts.iter().fold(Counts::default(), |sum, of| sum + *of);
        before = if round == 0 { all } else { before };
        last = all;
        let Some(steps) = system.solved(&is_told) else { return vec![false; frames.len()] };
        for (host, sums) in sums.iter().enumerate() {
            sums.move_depths(&mut patches[host], &system::steps_of(host, &partners[host], &steps));
        }
        frames.iter_mut().zip(&steps).for_each(|(frame, step)| frame.camera = pair::moved(&frame.camera, step));
        let square = steps.iter().flat_map(|step| &step[..3]).map(|turn| turn * turn).sum::<f64>();
        let turn = (square / frames.len() as f64).sqrt();
        let (side, count) = (frames[0].side(), patches.iter().map(Vec::len).sum::<usize>());
        tracing::debug!(
            "poses, {side} px, round {round}: {count} patches, {} of {} comparisons match, rotation {:.4} degrees",
            all.matching / 2,
            all.compared / 2,
            turn.to_degrees()
        );
        if turn < TURN_MIN {
            break;
        }
    }
    if is_sound(last, before.compared) { is_known } else { vec![false; frames.len()] }
}

/// Returns true if the comparisons are sound. `before` is the number of comparisons before the first step.
fn is_sound(all: Counts, before: usize) -> bool {
    let (compared, matching) = (all.compared as f64, all.matching as f64);
    let is_sound = matching >= ALL_MATCHES_MIN * compared && compared >= COMPARABLE_MIN * before as f64;
    if !is_sound {
        let numbers = format!("{} of {} photo comparisons match", all.matching / 2, all.compared / 2);
        tracing::info!("poses: {numbers}, {} were possible before; too few", before / 2);
    }
    is_sound
}

#[cfg(test)]
mod tests {
    use super::{Frame, adjusted};
    use crate::scene::Camera;
    use glam::{DMat3, DVec2, DVec3};

    const SIZE: (u32, u32) = (160, 120);

    /// A camera on a ring around the origin.
    fn camera(k: usize) -> Camera {
        let angle = 0.2 + 0.14 * k as f64;
        let forward = DVec3::new(-angle.cos(), -angle.sin(), -0.6 - 0.3 * (k % 2) as f64).normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let (width, height) = SIZE;
        let (fx, cx, cy) = (150.0, f64::from(width) / 2.0, f64::from(height) / 2.0);
        let centre = DVec3::new(0.0, 0.0, 0.4) - 4.0 * forward;
        Camera { rotation, translation: -(rotation * centre), fx, fy: fx, cx, cy, width, height }
    }

    /// Three walls of a room with wavy colours, seen from `truth`; `depth` scales the known depths.
    fn photo(truth: &Camera, given: &Camera, depth: f64) -> Frame {
        let (mut rgb, mut depths) = (Vec::new(), Vec::new());
        for index in 0..(truth.width * truth.height) as usize {
            let pixel = truth.pixel_centre(index);
            let (origin, ray) = (truth.centre(), truth.unproject(pixel, 1.0) - truth.centre());
            let walls = DVec3::AXES.map(|axis| (-0.8 - origin.dot(axis)) / ray.dot(axis));
            let z = walls.into_iter().filter(|&z| z > 0.0).fold(f64::INFINITY, f64::min);
            let place = origin + z * ray;
            let wave = |k: f64| {
                (0.5 + 0.2 * ((7.0 + k) * place.x + k).sin()
                    + 0.2 * ((8.0 - k) * place.y).cos() * (9.0 * place.z + k).sin()) as f32
            };
            rgb.push([wave(0.0), wave(1.5), wave(3.0)]);
            depths.push((z * depth) as f32);
        }
        Frame::from_colours(given.clone(), &rgb, depths)
    }

    /// Rotation errors between neighbours, degrees: the rotation of the whole ring is undetermined.
    fn errors(truth: &[Camera], found: &[Camera]) -> f64 {
        let between = |cameras: &[Camera], k: usize| cameras[k + 1].rotation * cameras[k].rotation.transpose();
        let apart = |k: usize| glam::DQuat::from_mat3(&(between(truth, k) * between(found, k).transpose()));
        let each = (0..truth.len() - 1).map(|k| 2.0 * apart(k).xyz().length().asin().to_degrees());
        each.sum::<f64>() / (truth.len() - 1) as f64
    }

    #[test]
    fn poses_come_back_from_photos() {
        let truth: Vec<Camera> = (0..9).map(camera).collect();
        let off = |(k, camera): (usize, &Camera)| {
            let sign = |by: usize| if (k + by).is_multiple_of(2) { 1.0 } else { -1.0 };
            let turn = DVec3::new(sign(0), sign(k / 2), 0.5 * sign(k / 3)) * 3e-3;
            camera.corrected(turn, DVec3::new(0.5 * sign(k / 2), sign(k / 4), sign(1)) * 0.01)
        };
        let given: Vec<Camera> = truth.iter().enumerate().map(off).collect();
        // Depths are too large and too small in alternate photos.
        let depth = |k: usize| if k.is_multiple_of(2) { 1.01 } else { 0.99 };
        let frame = |k: usize| photo(&truth[k], &given[k], depth(k));
        let mut frames: Vec<Frame> = (0..truth.len()).map(frame).collect();
        // One photo has no texture to match.
        frames[4].colours.fill([[0.5; 3], [0.0; 3], [0.0; 3]]);
        let found = adjusted(frames);
        assert!(found[4].is_none());
        let rest = |of: &[Camera]| {
            of.iter().enumerate().filter(|(k, _)| *k != 4).map(|(_, of)| of.clone()).collect::<Vec<_>>()
        };
        let found: Vec<Camera> = found.into_iter().flatten().collect();
        assert_eq!(found.len(), truth.len() - 1);
        let (before, after) = (errors(&rest(&truth), &rest(&given)), errors(&rest(&truth), &found));
        assert!(after < 0.05 * before, "{after} of {before} degrees");
    }

    /// A pose is recovered from six pixels off, and not guessed by chance from twenty.
    #[test]
    fn a_pose_far_off_is_found_or_unknown() {
        let truth: Vec<Camera> = (0..9).map(camera).collect();
        let with_turn = |turn: f64| {
            let mut frames: Vec<Frame> = truth.iter().map(|camera| photo(camera, camera, 1.0)).collect();
            frames[3].camera = truth[3].corrected(DVec3::new(turn, -turn, 0.0), DVec3::ZERO);
            adjusted(frames)
        };
        let found: Vec<Camera> = with_turn(0.04).into_iter().map(|found| found.expect("found")).collect();
        assert!(errors(&truth[2..4], &found[2..4]) < 0.1);
        let found = with_turn(0.14);
        let is_found: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert!(!is_found[3] && is_found[2] && is_found[4], "{is_found:?}");
    }

    #[test]
    fn photos_that_do_not_agree_tell_nothing() {
        let frame = |k: usize| {
            let own = |at: usize| f64::sin(((at + 7919 * k) * (at % 97 + 13)) as f64) as f32;
            let frame = photo(&camera(k), &camera(k), 1.0);
            let rgb: Vec<[f32; 3]> =
                frame.colours.iter().enumerate().map(|(at, [rgb, ..])| rgb.map(|of| of + 0.3 * own(at))).collect();
            Frame::from_colours(frame.camera, &rgb, frame.depth)
        };
        assert!(adjusted((0..6).map(frame).collect()).iter().all(Option::is_none));
    }

    #[test]
    fn half_a_frame_has_its_camera() {
        let frame = photo(&camera(0), &camera(0), 1.0);
        let half = frame.halved();
        let place = frame.camera.unproject(DVec2::new(71.0, 43.0), 3.0);
        let (full, small) = (frame.camera.sees(place).expect("seen"), half.camera.sees(place).expect("seen"));
        assert!(full.distance(2.0 * small) < 1e-9);
        let colour = |frame: &Frame, at: DVec2| frame.colours(at.x, at.y).expect("inside")[0];
        let apart =
            colour(&frame, full).iter().zip(colour(&half, small)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 0.01, "{apart}");
    }
}
