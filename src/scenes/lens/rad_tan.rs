//! Project Aria's fisheye, COLMAP's RAD_TAN_THIN_PRISM_FISHEYE.

use super::Projection;
use super::polynomial::tangential;
use super::projection::angle_of;
use glam::{DVec2, DVec3};

/// A direction at angle a from the axis is at distance r = a (1 + k0 a^2 + ... + k5 a^12). Tangential and thin prism
/// terms depend on that position, the latter as s0 r^2 + s1 r^4 in x and s2 r^2 + s3 r^4 in y. Project Aria calls the
/// model Fisheye624.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadTan {
    /// k0 to k5.
    pub radial: [f64; 6],
    /// p0 and p1; p0 belongs to x, unlike in OpenCV.
    pub tangential: [f64; 2],
    /// s0 to s3.
    pub prism: [f64; 4],
}

impl RadTan {
    /// Reads COLMAP's list: k0 to k5, p0 p1, s0 to s3.
    pub(super) fn from_list(list: &[f64]) -> Self {
        let at = |index: usize| list.get(index).copied().unwrap_or(0.0);
        Self {
            radial: std::array::from_fn(at),
            tangential: [at(6), at(7)],
            prism: std::array::from_fn(|index| at(8 + index)),
        }
    }

    fn radial(&self, a2: f64) -> f64 {
        1.0 + self.radial.iter().rev().fold(0.0, |sum, k| a2 * (k + sum))
    }
}

impl Projection for RadTan {
    fn is_valid(&self) -> bool {
        self.radial.iter().chain(&self.tangential).chain(&self.prism).all(|k| k.is_finite())
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let at = angle_of(direction);
        let at = at * self.radial(at.length_squared());
        let (r2, [p0, p1], [s0, s1, s2, s3]) = (at.length_squared(), self.tangential, self.prism);
        at + (tangential(at, [p1, p0]) + DVec2::new(r2 * (s0 + r2 * s1), r2 * (s2 + r2 * s3)))
    }

    fn radius(&self, angle: f64) -> f64 {
        angle * self.radial(angle * angle)
    }
}
