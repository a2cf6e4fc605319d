//! COLMAP's FOV lens.

use super::Projection;
use glam::{DVec2, DVec3};

/// A point of the plane z = 1 at distance r from the axis moves to atan(2 r tan(w / 2)) / w. Devernay and Faugeras,
/// *Straight lines have to be straight* (2001).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fov {
    /// The angle w, radians, above 0 and below pi.
    pub angle: f64,
}

impl Fov {
    fn bend(&self, radius: f64) -> f64 {
        (2.0 * radius * (self.angle / 2.0).tan()).atan() / self.angle
    }
}

impl Projection for Fov {
    fn is_valid(&self) -> bool {
        self.angle > 0.0 && self.angle < std::f64::consts::PI
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let ideal = direction.truncate() / direction.z;
        let radius = ideal.length();
        // At the axis, use the slope of the arc tangent.
        let factor =
            if radius > 1e-9 { self.bend(radius) / radius } else { 2.0 * (self.angle / 2.0).tan() / self.angle };
        ideal * factor
    }

    fn radius(&self, angle: f64) -> f64 {
        self.bend(angle.tan())
    }
}
