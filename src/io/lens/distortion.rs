//! The interface of lens models.

use glam::DVec2;
use std::fmt::Debug;

/// A lens model: maps rays to rays. A ray is given by its point on the plane z = 1.
pub trait Distortion: Debug + Sync {
    /// Returns true if every coefficient is finite.
    fn is_finite(&self) -> bool;

    /// Returns the point on the image plane of the real lens for the ideal point.
    fn distort(&self, ideal: DVec2) -> DVec2;

    /// Returns the distorted distance from the axis for `radius`, without the tangential part.
    fn bent_radius(&self, radius: f64) -> f64;

    /// Returns the largest radius up to which the lens is one to one, at most `limit`. A polynomial may decrease beyond
    /// it and would show parts of the photo twice.
    fn valid_radius(&self, limit: f64) -> f64 {
        const STEPS: u32 = 2048;
        let mut before = 0.0;
        for step in 1..=STEPS {
            let bent = self.bent_radius(limit * f64::from(step) / f64::from(STEPS));
            // A pole gives infinities and ends the range too.
            if bent.is_nan() || bent <= before || bent.is_infinite() {
                return limit * f64::from(step - 1) / f64::from(STEPS);
            }
            before = bent;
        }
        limit
    }
}
