//! What a lens must say of itself.

use glam::DVec2;
use std::fmt::Debug;

/// How a lens bends rays. They are given by where they meet the plane z = 1.
pub trait Distortion: Debug + Sync {
    /// True if every coefficient is a number.
    fn is_finite(&self) -> bool;

    /// Where the ray through `ideal` meets the image plane of the real lens.
    fn distort(&self, ideal: DVec2) -> DVec2;

    /// How far from the axis a ray ends up that was `radius` away from it, but for what is not symmetric.
    fn bent_radius(&self, radius: f64) -> f64;

    /// Distance from the axis up to which the lens is one to one, at most `limit`. Beyond it a polynomial turns round and
    /// would show parts of the photo a second time.
    fn valid_radius(&self, limit: f64) -> f64 {
        const STEPS: u32 = 2048;
        let mut before = 0.0;
        for step in 1..=STEPS {
            let bent = self.bent_radius(limit * f64::from(step) / f64::from(STEPS));
            // A pole of a denominator gives infinities, which end the range too.
            if bent.is_nan() || bent <= before || bent.is_infinite() {
                return limit * f64::from(step - 1) / f64::from(STEPS);
            }
            before = bent;
        }
        limit
    }
}
