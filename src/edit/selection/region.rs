//! Selects Gaussians by a shape drawn over a render, or by position.

use glam::{DVec2, DVec3};
use labelgs_scene::{Camera, Gaussians};
use rayon::prelude::*;
use serde::Deserialize;

/// How far behind the rendered surface a centre may be and still count as seen, in standard deviations along its
/// longest axis. Blending shows a surface slightly in front of most of its Gaussians.
const SEEN_BEHIND_DEVIATIONS: f64 = 1.0;
/// The same, as a share of the surface's depth; both add up.
const SEEN_BEHIND_DEPTH_SHARE: f64 = 0.01;
/// Least opacity of a Gaussian that counts as seen.
const SEEN_OPACITY_MIN: f64 = 0.05;

/// A shape drawn over a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// The inside of a closed line.
    Inside,
    /// The pixels near a line.
    Along,
}

/// A part of a render.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Whether the region is inside the line or along it.
    pub shape: Shape,
    /// Corners of the line, px from the corner of the first pixel.
    pub points: Vec<[f64; 2]>,
    /// Half the width of a region along a line, px.
    #[serde(default)]
    pub radius: f64,
}

impl Region {
    /// Returns true if a point is in the region.
    pub fn has(&self, at: DVec2) -> bool {
        match self.shape {
            Shape::Inside => self.is_inside(at),
            Shape::Along => self.is_along(at),
        }
    }

    /// Counts whether a ray to the right crosses the outline an odd number of times.
    fn is_inside(&self, at: DVec2) -> bool {
        let crosses = |(a, b): (DVec2, DVec2)| {
            (a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        self.sides(true).filter(|&side| crosses(side)).count() % 2 == 1
    }

    fn is_along(&self, at: DVec2) -> bool {
        let distance = |(a, b): (DVec2, DVec2)| {
            let along = b - a;
            let share = ((at - a).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            at.distance_squared(a + along * share)
        };
        self.sides(false).any(|side| distance(side) <= self.radius * self.radius)
    }

    /// Returns the lines between the points, including the closing one if `is_closed`. A single point is a line.
    fn sides(&self, is_closed: bool) -> impl Iterator<Item = (DVec2, DVec2)> {
        let count = self.points.len();
        let lines = if is_closed || count == 1 { count } else { count.saturating_sub(1) };
        (0..lines).map(move |index| (self.points[index].into(), self.points[(index + 1) % count].into()))
    }
}

/// Returns the Gaussians whose centre projects into a region of `camera`. With `depth`, the depth of the rendered
/// surface per pixel, it returns only visible Gaussians; without it, also those behind.
pub fn in_region(model: &Gaussians, camera: &Camera, region: &Region, depth: Option<&[f32]>) -> Vec<bool> {
    let found = |row: usize| {
        let world = model.world(row);
        camera.sees(world).is_some_and(|pixel| {
            let z = camera.to_camera(world).z;
            region.has(pixel) && depth.is_none_or(|depth| is_seen(model, row, camera, (pixel, z), depth))
        })
    };
    (0..model.len()).into_par_iter().map(found).collect()
}

fn is_seen(model: &Gaussians, row: usize, camera: &Camera, (pixel, z): (DVec2, f64), depth: &[f32]) -> bool {
    let surface = f64::from(depth[pixel.y as usize * camera.width as usize + pixel.x as usize]);
    let longest = model.scales[row].iter().copied().fold(f32::MIN, f32::max);
    let behind = SEEN_BEHIND_DEVIATIONS * f64::from(longest).exp() + SEEN_BEHIND_DEPTH_SHARE * surface;
    model.opacity(row) >= SEEN_OPACITY_MIN && (surface <= 0.0 || z <= surface + behind)
}

/// Returns the Gaussians whose centre is in a sphere.
pub fn in_sphere(model: &Gaussians, centre: DVec3, radius: f64) -> Vec<bool> {
    (0..model.len()).into_par_iter().map(|row| model.world(row).distance(centre) <= radius).collect()
}

/// A side of a depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Nearer to the camera.
    Front,
    /// Farther, or behind the camera.
    Behind,
}

/// Returns the Gaussians on a side of a depth of a camera.
pub fn beyond(model: &Gaussians, camera: &Camera, depth: f64, side: Side) -> Vec<bool> {
    let is_on_side = |row| {
        let z = camera.to_camera(model.world(row)).z;
        match side {
            Side::Front => z > 0.0 && z < depth,
            Side::Behind => z >= depth,
        }
    };
    (0..model.len()).into_par_iter().map(is_on_side).collect()
}
