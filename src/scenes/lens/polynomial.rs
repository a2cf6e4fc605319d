//! OpenCV's lens model.

use super::Projection;
use glam::{DVec2, DVec3};

/// OpenCV's radial and tangential distortion; a pinhole if all coefficients are 0.
///
/// A point (x, y) on the plane z = 1 with distance r from the axis moves to (x, y) (1 + n1 r^2 + n2 r^4 + n3 r^6 + n4
/// r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6) plus the tangential part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polynomial {
    /// Numerator: k1, k2 and k3 of OpenCV, and the factor of r^8 that nerfstudio and Metashape call k4.
    pub numerator: [f64; 4],
    /// Denominator: k4, k5 and k6 of OpenCV's full model.
    pub denominator: [f64; 3],
    /// Tangential part: p1 and p2.
    pub tangential: [f64; 2],
    /// Contribution of y to x: Metashape's b2 over the focal length.
    pub skew: f64,
}

impl Polynomial {
    /// Reads COLMAP's list: k1 k2 p1 p2 k3 k4 k5 k6, or the first of them.
    pub(super) fn from_list(list: &[f64]) -> Self {
        let at = |index: usize| list.get(index).copied().unwrap_or(0.0);
        let (numerator, denominator) = ([at(0), at(1), at(4), 0.0], [at(5), at(6), at(7)]);
        Self { numerator, denominator, tangential: [at(2), at(3)], skew: 0.0 }
    }

    /// Reads the names of `transforms.json`.
    pub(super) fn from_names(value: &dyn Fn(&str) -> f64) -> Self {
        let numerator = ["k1", "k2", "k3", "k4"].map(value);
        Self { numerator, tangential: ["p1", "p2"].map(value), ..Self::default() }
    }

    fn radial(&self, r2: f64) -> f64 {
        let ([n1, n2, n3, n4], [d1, d2, d3]) = (self.numerator, self.denominator);
        (1.0 + r2 * (n1 + r2 * (n2 + r2 * (n3 + r2 * n4)))) / (1.0 + r2 * (d1 + r2 * (d2 + r2 * d3)))
    }

    /// Returns where the lens moves a point of the plane z = 1.
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        let at = ideal * self.radial(ideal.length_squared()) + tangential(ideal, self.tangential);
        at + DVec2::new(self.skew * at.y, 0.0)
    }
}

/// The tangential term of OpenCV's models.
pub(super) fn tangential(at: DVec2, [p1, p2]: [f64; 2]) -> DVec2 {
    let (x, y, r2) = (at.x, at.y, at.length_squared());
    DVec2::new(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)
}

impl Projection for Polynomial {
    fn is_valid(&self) -> bool {
        self.numerator
            .iter()
            .chain(&self.denominator)
            .chain(&self.tangential)
            .chain([&self.skew])
            .all(|k| k.is_finite())
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        self.distort(direction.truncate() / direction.z)
    }

    fn radius(&self, angle: f64) -> f64 {
        let radius = angle.tan();
        radius * self.radial(radius * radius)
    }
}
