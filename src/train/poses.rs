//! Poses of the photos: a correction of each, trained beside the Gaussians.
//!
//! Poses of a reconstruction may be off by pixels, which blurs the model. The camera of a step is turned and moved by the
//! correction of its photo. Photos together leave place and turn of the whole open, and hardly tell slow bends of a path of
//! cameras; a weak pull to 0 holds both.

use super::shared::{Place, SharedLayout, SharedParameters};
use super::strategy::At;
use crate::pass::{Builder, Extension, Hook, project};
use crate::scene::{Camera, Dataset, Point, View};
use glam::DVec3;
use std::sync::Arc;

/// Name of the parameters.
pub(super) const NAME: &str = "poses";
/// Learning rate of turns, radians, and of moves, depths of the scene, in the beginning. The updates of a short run, some
/// dozens a photo, reach a degree and a fiftieth of the depth. The rate falls to the share [`FALL`] of itself.
const RATE: f64 = 1.5e-3;
const FALL: f64 = 0.02;
/// Share of the run before the first update: Gaussians have no colours of their own yet.
const FROM: f64 = 0.08;

/// Corrections of the poses, 0 in the beginning.
#[derive(Clone, Debug, Default)]
pub struct Poses {
    depths: Vec<f32>,
}

impl Poses {
    /// Makes the parameters of a scene.
    pub fn new(dataset: &Dataset) -> Self {
        let depth = |view: &View| {
            let seen = |point: &&Point| view.camera.sees(point.position).is_some();
            let depth = |point: &Point| view.camera.to_camera(point.position).z;
            let mut depths: Vec<f64> = dataset.points.iter().filter(seen).map(depth).collect();
            depths.sort_by(f64::total_cmp);
            depths.get(depths.len() / 2).copied().unwrap_or(dataset.extent()) as f32
        };
        Self { depths: dataset.train.iter().map(depth).collect() }
    }
}

/// Returns a camera with the correction of its two rows (glsl/include/pose.glsl).
pub(crate) fn corrected(camera: &Camera, [turn, shift]: [[f32; 4]; 2]) -> Camera {
    let wide = |[x, y, z, _]: [f32; 4]| DVec3::new(x.into(), y.into(), z.into());
    let ([turn, by], unit) = ([turn, shift].map(wide), f64::from(shift[3]));
    camera.corrected(turn, camera.rotation.transpose() * (unit * by))
}

impl SharedParameters for Poses {
    fn name(&self) -> &'static str {
        NAME
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 0, photo: 2 }
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        view.map_or(Vec::new(), |view| vec![[0.0; 4], [0.0, 0.0, 0.0, self.depths[view]]])
    }

    fn rates(&self, at: At) -> Vec<[f32; 4]> {
        let part = f64::from(at.step) / f64::from(at.config.iterations);
        let rate = if part > FROM { (RATE * FALL.powf(part)) as f32 } else { 0.0 };
        vec![[rate, rate, rate, 0.0]; 2]
    }

    fn extension(&self, place: Place) -> Arc<dyn Extension> {
        Arc::new(Passes(place))
    }
}

#[derive(Debug)]
struct Passes(Place);

impl Extension for Passes {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        match hook {
            Hook::Camera => project::pose(b, self.0.photo),
            Hook::Gradients => project::pose_backward(b, self.0.photo),
            Hook::Picture | Hook::Loss | Hook::Updated => {}
        }
    }
}
