//! COLMAP's division model.

use super::Projection;
use glam::{DVec2, DVec3};

/// An image point p corresponds to the direction (p, 1 + k |p|^2). Fitzgibbon, *Simultaneous linear estimation of
/// multiple view geometry and lens distortion* (2001).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Division {
    /// The coefficient k.
    pub k: f64,
}

impl Division {
    /// Returns the scale of a direction's lateral part, whose length is `across`.
    fn factor(&self, across: f64, along: f64) -> f64 {
        2.0 / (along + (along * along - 4.0 * self.k * across * across).sqrt())
    }
}

impl Projection for Division {
    fn is_valid(&self) -> bool {
        self.k.is_finite()
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let across = direction.truncate();
        across * self.factor(across.length(), direction.z)
    }

    fn radius(&self, angle: f64) -> f64 {
        angle.sin() * self.factor(angle.sin(), angle.cos())
    }
}
