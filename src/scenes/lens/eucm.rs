//! COLMAP's enhanced unified camera model.

use super::Projection;
use glam::{DVec2, DVec3};

/// A direction (x, y, z) is at (x, y) / (alpha sqrt(beta (x^2 + y^2) + z^2) + (1 - alpha) z). Khomutenko, Garcia and
/// Martinet, *An enhanced unified camera model* (2016).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eucm {
    /// From 0 to 1; 0 is a pinhole.
    pub alpha: f64,
    /// Above 0.
    pub beta: f64,
}

impl Eucm {
    fn divisor(&self, across2: f64, along: f64) -> f64 {
        self.alpha * (self.beta * across2 + along * along).sqrt() + (1.0 - self.alpha) * along
    }
}

impl Projection for Eucm {
    fn is_valid(&self) -> bool {
        (0.0..=1.0).contains(&self.alpha) && self.beta > 0.0 && self.beta.is_finite()
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let across = direction.truncate();
        across / self.divisor(across.length_squared(), direction.z)
    }

    fn radius(&self, angle: f64) -> f64 {
        angle.sin() / self.divisor(angle.sin().powi(2), angle.cos())
    }
}
