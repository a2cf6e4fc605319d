//! A smooth path through posed cameras: an order of the cameras, and interpolated cameras between neighbours.

use super::Camera;
use glam::{DMat3, DQuat, DVec3};

/// Most start cameras of the greedy search; more take time and hardly shorten the path.
const STARTS_MAX: usize = 32;
/// Smallest gain of an exchange, so that rounding errors cannot cause an endless loop.
const GAIN_MIN: f64 = 1e-12;

/// The interpolation between two cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Interpolates centres and intrinsics linearly.
    Centres,
    /// As in the LabelGS code: interpolates the translation of camera-from-world, so that the centre may leave the
    /// line. The intrinsics are those of the first camera.
    Translations,
}

/// Centres in units of the cameras' radius, and rotations, for computing distances.
struct PathPoses {
    centres: Vec<DVec3>,
    rotations: Vec<DQuat>,
}

impl PathPoses {
    fn new(cameras: &[&Camera]) -> Self {
        let centres: Vec<DVec3> = cameras.iter().map(|camera| camera.centre()).collect();
        let mean = centres.iter().sum::<DVec3>() / centres.len().max(1) as f64;
        let radius = centres.iter().map(|centre| centre.distance(mean)).fold(0.0, f64::max);
        // Centres have rounding errors. Cameras that rotate in one place differ only by these, which do not count as a
        // radius.
        let far = centres.iter().map(|centre| centre.length()).fold(0.0, f64::max);
        let unit = if radius > 1e-9 * far { radius } else { far.max(1.0) };
        let rotations = cameras.iter().map(|camera| DQuat::from_mat3(&camera.rotation).normalize()).collect();
        Self { centres: centres.iter().map(|centre| *centre / unit).collect(), rotations }
    }

    /// Returns the distance of the centres plus the angle between the rotations, radians. An image changes about
    /// equally when the camera turns by a radian and when it moves by its distance to the subject. The radius stands in
    /// for this distance.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let cosine = self.rotations[a].dot(self.rotations[b]).abs().min(1.0);
        self.centres[a].distance(self.centres[b]) + 2.0 * cosine.acos()
    }
}

/// Returns an order of the cameras in which neighbours have similar poses: the shortest of several greedy paths,
/// improved by exchanging pairs of edges (2-opt). The result is deterministic. The end with the smaller index comes
/// first.
pub fn short_order(cameras: &[&Camera]) -> Vec<usize> {
    let (places, count) = (PathPoses::new(cameras), cameras.len());
    let starts = count.min(STARTS_MAX);
    let paths = (0..starts).map(|start| greedy(&places, start * count / starts));
    let mut order = paths.min_by(|a, b| length(&places, a).total_cmp(&length(&places, b))).unwrap_or_default();
    while exchange(&places, &mut order) {}
    if order.first() > order.last() {
        order.reverse();
    }
    order
}

fn length(places: &PathPoses, order: &[usize]) -> f64 {
    order.windows(2).map(|pair| places.distance(pair[0], pair[1])).sum()
}

/// Returns the greedy path from `start`, which always continues to the nearest remaining camera.
fn greedy(places: &PathPoses, start: usize) -> Vec<usize> {
    let mut left: Vec<usize> = (0..places.centres.len()).filter(|&other| other != start).collect();
    let mut order = vec![start];
    let mut last = start;
    while !left.is_empty() {
        let away = |&at: &usize| places.distance(last, left[at]);
        let Some(at) = (0..left.len()).min_by(|a, b| away(a).total_cmp(&away(b))) else { break };
        last = left.remove(at);
        order.push(last);
    }
    order
}

/// Reverses each section of the path if that shortens it. Returns true if any section was reversed. The ends are free,
/// so a section at an end loses only one edge.
fn exchange(places: &PathPoses, order: &mut [usize]) -> bool {
    let mut shorter = false;
    for first in 0..order.len() {
        for last in first + 1..order.len() {
            let edge = |a: Option<usize>, b: Option<usize>| match (a, b) {
                (Some(a), Some(b)) => places.distance(order[a], order[b]),
                _ => 0.0,
            };
            let (before, after) = (first.checked_sub(1), Some(last + 1).filter(|&at| at < order.len()));
            let now = edge(before, Some(first)) + edge(Some(last), after);
            let turned = edge(before, Some(last)) + edge(Some(first), after);
            if turned < now - GAIN_MIN {
                order[first..=last].reverse();
                shorter = true;
            }
        }
    }
    shorter
}

/// Returns the camera at `t` from 0 to 1 between `a` and `b`, with the size of `a`. The rotation is uniform along the
/// shorter way.
pub fn interpolate(a: &Camera, b: &Camera, t: f64, how: Interpolation) -> Camera {
    let turn = DQuat::from_mat3(&a.rotation).normalize().slerp(DQuat::from_mat3(&b.rotation).normalize(), t);
    let rotation = DMat3::from_quat(turn.normalize());
    let mix = |a: f64, b: f64| a + (b - a) * t;
    match how {
        Interpolation::Translations => {
            Camera { rotation, translation: a.translation.lerp(b.translation, t), ..a.clone() }
        }
        Interpolation::Centres => Camera {
            rotation,
            translation: -(rotation * a.centre().lerp(b.centre(), t)),
            fx: mix(a.fx, b.fx),
            fy: mix(a.fy, b.fy),
            cx: mix(a.cx, b.cx),
            cy: mix(a.cy, b.cy),
            width: a.width,
            height: a.height,
        },
    }
}

/// A frame of a video along a camera path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFrame {
    /// Index of the camera at this frame, or `None` between two cameras.
    pub camera_index: Option<usize>,
    /// Camera of the frame; at an index, exactly that camera.
    pub camera: Camera,
}

/// Returns the frames of a video through `cameras` in the given order, with `count` frames between neighbours. n
/// cameras result in (count + 1)(n - 1) + 1 frames; camera i is frame (count + 1) i.
pub fn video(cameras: &[&Camera], count: u32, how: Interpolation) -> Vec<PathFrame> {
    let at = |index: usize| PathFrame { camera_index: Some(index), camera: cameras[index].clone() };
    let on_the_way = |index: usize| {
        let (a, b) = (cameras[index], cameras[index + 1]);
        let part = move |step: u32| f64::from(step) / f64::from(count + 1);
        (1..=count).map(move |step| PathFrame { camera_index: None, camera: interpolate(a, b, part(step), how) })
    };
    let mut frames = Vec::new();
    for index in 0..cameras.len() {
        frames.push(at(index));
        if index + 1 < cameras.len() {
            frames.extend(on_the_way(index));
        }
    }
    frames
}
