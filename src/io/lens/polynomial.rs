//! The lens model of OpenCV.

use super::distortion::Distortion;
use glam::DVec2;

/// Radial and tangential distortion of OpenCV; with all coefficients 0 a pinhole.
///
/// A point (x, y) on the plane z = 1 with distance r from the axis moves to (x, y) (1 + n1 r^2 + n2 r^4 + n3 r^6 + n4
/// r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6) plus the tangential part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polynomial {
    /// Numerator: k1, k2 and k3 of OpenCV, and the factor of r^8 that nerfstudio calls k4.
    pub numerator: [f64; 4],
    /// Denominator: k4, k5 and k6 of OpenCV's full model.
    pub denominator: [f64; 3],
    /// Tangential part: p1 and p2.
    pub tangential: [f64; 2],
}

impl Polynomial {
    /// Reads COLMAP's list: k1 k2 p1 p2 k3 k4 k5 k6, or the first of them.
    pub(super) fn of_list(list: &[f64]) -> Self {
        let at = |index: usize| list.get(index).copied().unwrap_or(0.0);
        let (numerator, denominator) = ([at(0), at(1), at(4), 0.0], [at(5), at(6), at(7)]);
        Self { numerator, denominator, tangential: [at(2), at(3)] }
    }

    /// Reads the names of `transforms.json`.
    pub(super) fn of_names(value: &dyn Fn(&str) -> f64) -> Self {
        let numerator = ["k1", "k2", "k3", "k4"].map(value);
        Self { numerator, denominator: [0.0; 3], tangential: ["p1", "p2"].map(value) }
    }

    fn radial(&self, r2: f64) -> f64 {
        let ([n1, n2, n3, n4], [d1, d2, d3]) = (self.numerator, self.denominator);
        (1.0 + r2 * (n1 + r2 * (n2 + r2 * (n3 + r2 * n4)))) / (1.0 + r2 * (d1 + r2 * (d2 + r2 * d3)))
    }
}

impl Distortion for Polynomial {
    fn is_finite(&self) -> bool {
        self.numerator.iter().chain(&self.denominator).chain(&self.tangential).all(|k| k.is_finite())
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        let (x, y, r2, [p1, p2]) = (ideal.x, ideal.y, ideal.length_squared(), self.tangential);
        let radial = self.radial(r2);
        DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    fn bent_radius(&self, radius: f64) -> f64 {
        radius * self.radial(radius * radius)
    }
}
