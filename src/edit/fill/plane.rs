//! Planes through points, by random samples of three (RANSAC) and least squares.

use glam::{DMat3, DVec3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Number of random planes per fit.
const PLANE_TRIES: usize = 300;
/// Most planes per set of points.
const PLANES_MAX: usize = 6;
/// Least number of points on a plane.
const PLANE_POINTS_MIN: usize = 60;
/// Least share of the points on a plane.
const PLANE_POINTS_SHARE_MIN: f64 = 0.03;
/// Largest distance of a point from its plane, in cells.
const PLANE_DISTANCE_MAX: f64 = 1.5;
/// Distance of points from a plane that may lie on another, in cells, and the least cosine of the normals of two planes
/// that are one if they are near.
const OTHER_PLANE_DISTANCE: f64 = 4.0;
const NORMAL_COSINE_MIN: f64 = 0.97;
/// Seed of the samples.
const SEED: u64 = 0;

/// A plane with axes in it; all of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// A point of it.
    pub origin: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// First axis.
    pub u: DVec3,
    /// Second axis; u, v and the normal are right-handed.
    pub v: DVec3,
}

impl Plane {
    fn new(origin: DVec3, normal: DVec3) -> Self {
        let u = normal.any_orthonormal_vector();
        Self { origin, normal, u, v: normal.cross(u) }
    }

    /// Returns the same plane with a normal to the side of a point.
    pub(super) fn facing(self, point: DVec3) -> Self {
        if self.height(point) >= 0.0 { self } else { Self::new(self.origin, -self.normal) }
    }

    /// Returns the distance of a point, with a sign.
    pub(super) fn height(&self, point: DVec3) -> f64 {
        (point - self.origin).dot(self.normal)
    }

    /// Returns the plane with the least squared distance to the points, none of which is far from it; `None` if they
    /// lie on a line.
    fn refined(&self, points: &[DVec3]) -> Option<Self> {
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        // Height above this plane as a linear function of the place in it.
        let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for &point in points {
            let from = point - middle;
            let row = DVec3::new(from.dot(self.u), from.dot(self.v), 1.0);
            matrix += DMat3::from_cols(row * row.x, row * row.y, row);
            right += row * from.dot(self.normal);
        }
        let scale = matrix.x_axis.x.max(matrix.y_axis.y);
        if matrix.determinant() < 1e-6 * scale * scale * points.len() as f64 {
            return None;
        }
        let slope = matrix.inverse() * right;
        let normal = self.normal - slope.x * self.u - slope.y * self.v;
        Some(Self::new(middle + slope.z * self.normal, normal.normalize()))
    }
}

/// Returns the planes that hold most of the points, the fullest first.
pub(super) fn planes(points: &[DVec3], cell: f64) -> Vec<Plane> {
    let mut random = Pcg64::seed_from_u64(SEED);
    let (mut left, mut found) = (points.to_vec(), Vec::new());
    let least = PLANE_POINTS_MIN.max((PLANE_POINTS_SHARE_MIN * points.len() as f64) as usize);
    for _ in 0..PLANES_MAX {
        if left.len() < least {
            break;
        }
        let near = |plane: &Plane, point: &DVec3| plane.height(*point).abs() <= PLANE_DISTANCE_MAX * cell;
        let count = |plane: &Plane| left.iter().filter(|point| near(plane, point)).count();
        let mut best: Option<(usize, Plane)> = None;
        for _ in 0..PLANE_TRIES {
            let [a, b, c] = [(); 3].map(|()| left[random.random_range(0..left.len())]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal == DVec3::ZERO {
                continue;
            }
            let plane = Plane::new(a, normal);
            let size = count(&plane);
            if best.is_none_or(|(most, _)| size > most) {
                best = Some((size, plane));
            }
        }
        let Some((_, rough)) = best.filter(|(size, _)| *size >= least) else { break };
        let on: Vec<DVec3> = left.iter().copied().filter(|point| near(&rough, point)).collect();
        let plane = rough.refined(&on).unwrap_or(rough);
        // Also those of the rough plane, so that each round takes points away.
        left.retain(|point| plane.height(*point).abs() > OTHER_PLANE_DISTANCE * cell && !near(&rough, point));
        let is_same = |other: &Plane| {
            other.normal.dot(plane.normal).abs() > NORMAL_COSINE_MIN
                && other.height(plane.origin).abs() < 2.0 * OTHER_PLANE_DISTANCE * cell
        };
        if !found.iter().any(is_same) {
            found.push(plane);
        }
    }
    found
}
