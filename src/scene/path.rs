//! A smooth path through posed cameras: an order of the cameras, and interpolated cameras between neighbours.

use super::Camera;
use glam::{DMat3, DQuat, DVec3};

/// Most start cameras of the greedy search; more cost time and hardly shorten the path.
const STARTS_MAX: usize = 32;
/// Least gain of an exchange, so that rounding errors cannot cause an endless loop.
const GAIN_MIN: f64 = 1e-12;

/// The interpolation between two cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Interpolates centres and intrinsics linearly.
    Centres,
    /// As in the code of LabelGS: interpolates the translation of camera-from-world, so that the centre may leave the
    /// line. The intrinsics are those of the first camera.
    Translations,
}

/// Centres in units of the cameras' radius, and rotations, for distances.
struct Places {
    centres: Vec<DVec3>,
    rotations: Vec<DQuat>,
}

impl Places {
    fn new(cameras: &[&Camera]) -> Self {
        let centres: Vec<DVec3> = cameras.iter().map(|camera| camera.centre()).collect();
        let mean = centres.iter().sum::<DVec3>() / centres.len().max(1) as f64;
        let radius = centres.iter().map(|centre| centre.distance(mean)).fold(0.0, f64::max);
        // Centres have rounding errors. Rotating cameras at one place differ only by these, which is no radius.
        let far = centres.iter().map(|centre| centre.length()).fold(0.0, f64::max);
        let unit = if radius > 1e-9 * far { radius } else { far.max(1.0) };
        let rotations = cameras.iter().map(|camera| DQuat::from_mat3(&camera.rotation).normalize()).collect();
        Self { centres: centres.iter().map(|centre| *centre / unit).collect(), rotations }
    }

    /// Returns the distance of the centres plus the angle between the poses in radians. An image changes about equally
    /// when the camera turns by a radian and when it moves by its distance to the subject. The radius stands for this
    /// distance.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let cosine = self.rotations[a].dot(self.rotations[b]).abs().min(1.0);
        self.centres[a].distance(self.centres[b]) + 2.0 * cosine.acos()
    }
}

/// Returns an order of the cameras in which neighbours have similar poses: the shortest of some greedy paths, improved
/// by exchanges of two edges (2-opt). The result is deterministic. The end with the smaller index comes first.
pub fn short_order(cameras: &[&Camera]) -> Vec<usize> {
    let (places, count) = (Places::new(cameras), cameras.len());
    let starts = count.min(STARTS_MAX);
    let paths = (0..starts).map(|start| greedy(&places, start * count / starts));
    let mut order = paths.min_by(|a, b| length(&places, a).total_cmp(&length(&places, b))).unwrap_or_default();
    while exchange(&places, &mut order) {}
    if order.first() > order.last() {
        order.reverse();
    }
    order
}

fn length(places: &Places, order: &[usize]) -> f64 {
    order.windows(2).map(|pair| places.distance(pair[0], pair[1])).sum()
}

/// Returns the greedy path from `start`, always to the nearest remaining camera.
fn greedy(places: &Places, start: usize) -> Vec<usize> {
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

/// Reverses each section of the path if that shortens it; returns true if any was reversed. The ends are free, so that
/// a section at an end loses only one edge.
fn exchange(places: &Places, order: &mut [usize]) -> bool {
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

/// Returns the camera at `t` from 0 to 1 between `a` and `b`, with the size of `a`. The rotation turns evenly along the
/// shorter way.
pub fn between(a: &Camera, b: &Camera, t: f64, how: Between) -> Camera {
    let turn = DQuat::from_mat3(&a.rotation).normalize().slerp(DQuat::from_mat3(&b.rotation).normalize(), t);
    let rotation = DMat3::from_quat(turn.normalize());
    let mix = |a: f64, b: f64| a + (b - a) * t;
    match how {
        Between::Translations => Camera { rotation, translation: a.translation.lerp(b.translation, t), ..a.clone() },
        Between::Centres => Camera {
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

/// A frame of a video through cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Index of the camera at this frame; `None` between two cameras.
    pub camera_index: Option<usize>,
    /// Camera of the frame; at an index, exactly that camera.
    pub camera: Camera,
}

/// Returns the frames of a video through `cameras` in their order, with `count` frames between neighbours. n cameras
/// give (count + 1)(n - 1) + 1 frames, and camera i is frame (count + 1) i.
pub fn video(cameras: &[&Camera], count: u32, how: Between) -> Vec<Stop> {
    let at = |index: usize| Stop { camera_index: Some(index), camera: cameras[index].clone() };
    let on_the_way = |index: usize| {
        let (a, b) = (cameras[index], cameras[index + 1]);
        let part = move |step: u32| f64::from(step) / f64::from(count + 1);
        (1..=count).map(move |step| Stop { camera_index: None, camera: between(a, b, part(step), how) })
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
