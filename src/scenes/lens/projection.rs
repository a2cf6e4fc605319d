//! The interface of lenses.

use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;
use std::fmt::Debug;

/// Steps of the search for a lens's range.
const RANGE_STEPS: u32 = 4096;
/// Most steps of Newton's method; a few are enough within the range.
const NEWTON_MAX: u32 = 30;
/// Tolerance of an inverted point at focal length 1: 1e-8 px in any photo.
const ERROR_MAX: f64 = 1e-13;

/// A lens: maps directions in camera axes (x right, y down, z forward) to points of the image plane at focal length 1,
/// relative to the principal point.
pub trait Projection: Debug + Sync {
    /// Returns true if all coefficients are finite and describe a lens.
    fn is_valid(&self) -> bool;

    /// Returns the image point of a direction of any length, within [`Projection::reach`] of the axis.
    fn project(&self, direction: DVec3) -> DVec2;

    /// Returns the distance from the principal point at `angle` from the axis, without terms that depend on the side.
    fn radius(&self, angle: f64) -> f64;

    /// Returns the largest angle from the axis, radians, up to which the lens is one to one. Beyond it, a polynomial
    /// may decrease and would show parts of the photo twice. At most 90 degrees, where COLMAP's lenses end.
    fn reach(&self) -> f64 {
        let mut before = 0.0;
        for step in 1..=RANGE_STEPS {
            let bent = self.radius(FRAC_PI_2 * f64::from(step) / f64::from(RANGE_STEPS));
            // A pole causes infinities and also ends the range.
            if bent.is_nan() || bent <= before || bent.is_infinite() {
                return FRAC_PI_2 * f64::from(step - 1) / f64::from(RANGE_STEPS);
            }
            before = bent;
        }
        FRAC_PI_2
    }

    /// Returns the unit direction that [`Projection::project`] maps to `point`, found by Newton's method; `None` if
    /// there is none. `reach` is the lens's.
    fn unproject(&self, point: DVec2, reach: f64) -> Option<DVec3> {
        // Solve for the direction times its angle from the axis, which is smooth at the axis.
        let mut at = point.clamp_length_max(0.9 * reach);
        let error = |at: DVec2| self.project(direction_of(at)) - point;
        let mut left = error(at);
        for _ in 0..NEWTON_MAX {
            if left.length() <= ERROR_MAX * (1.0 + point.length()) {
                break;
            }
            let h = 1e-6;
            let x = (error(at + DVec2::new(h, 0.0)) - error(at - DVec2::new(h, 0.0))) / (2.0 * h);
            let y = (error(at + DVec2::new(0.0, h)) - error(at - DVec2::new(0.0, h))) / (2.0 * h);
            let determinant = x.x * y.y - x.y * y.x;
            let step = DVec2::new(left.x * y.y - left.y * y.x, left.y * x.x - left.x * x.y) / determinant;
            // Halve the step until the error decreases: a whole step may leave the range of the lens.
            let better = (0..20).find_map(|halvings| {
                let next = (at - step / f64::from(1_u32 << halvings)).clamp_length_max(reach);
                let error = error(next);
                (error.length() < left.length()).then_some((next, error))
            });
            let Some((next, error)) = better else { break };
            (at, left) = (next, error);
        }
        (left.length() <= 1e-9 * (1.0 + point.length())).then(|| direction_of(at))
    }
}

/// Returns the unit direction at angle |`at`| from the axis, towards `at`.
pub(super) fn direction_of(at: DVec2) -> DVec3 {
    let angle = at.length();
    let side = at * if angle > 1e-9 { angle.sin() / angle } else { 1.0 };
    DVec3::new(side.x, side.y, angle.cos())
}

/// Returns the point at the direction's angle from the axis, towards the direction: the inverse of [`direction_of`].
pub(super) fn angle_of(direction: DVec3) -> DVec2 {
    let side = direction.truncate();
    let radius = side.length();
    if radius <= 1e-12 * direction.z {
        return side / direction.z;
    }
    side * (radius.atan2(direction.z) / radius)
}
