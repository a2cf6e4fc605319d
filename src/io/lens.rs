//! Lens distortion: where a pixel of the ideal pinhole image lies in the photo.

use glam::DVec2;

/// OpenCV's radial and tangential model; all zero is a pinhole.
///
/// With (x, y) on the plane z = 1 and r the distance from the axis, the ray is bent to
/// (x, y) (1 + n1 r^2 + n2 r^4 + n3 r^6 + n4 r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6) plus the tangential part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    /// Numerator: k1, k2, k3 of OpenCV and a term in r^8 that nerfstudio calls k4.
    pub numerator: [f64; 4],
    /// Denominator: k4, k5, k6 of OpenCV's full model.
    pub denominator: [f64; 3],
    /// p1, p2.
    pub tangential: [f64; 2],
}

impl Lens {
    /// True if nothing has to be undone.
    pub fn is_pinhole(&self) -> bool {
        *self == Self::default()
    }

    /// True if every coefficient is a number.
    pub fn is_finite(&self) -> bool {
        self.numerator.iter().chain(&self.denominator).chain(&self.tangential).all(|k| k.is_finite())
    }

    fn radial(&self, r2: f64) -> f64 {
        let ([n1, n2, n3, n4], [d1, d2, d3]) = (self.numerator, self.denominator);
        (1.0 + r2 * (n1 + r2 * (n2 + r2 * (n3 + r2 * n4)))) / (1.0 + r2 * (d1 + r2 * (d2 + r2 * d3)))
    }

    /// Where the ray through `ideal` (plane z = 1) meets the image plane of the real lens.
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        let (x, y, r2, [p1, p2]) = (ideal.x, ideal.y, ideal.length_squared(), self.tangential);
        let radial = self.radial(r2);
        DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// Distance from the axis up to which the model is one to one, at most `limit`. Beyond it a polynomial turns
    /// round and would show parts of the photo a second time.
    pub fn valid_radius(&self, limit: f64) -> f64 {
        const STEPS: u32 = 2048;
        let mut before = 0.0;
        for step in 1..=STEPS {
            let r = limit * f64::from(step) / f64::from(STEPS);
            let bent = r * self.radial(r * r);
            // A pole of the denominator gives infinities, which end the range too.
            if bent.is_nan() || bent <= before || bent.is_infinite() {
                return limit * f64::from(step - 1) / f64::from(STEPS);
            }
            before = bent;
        }
        limit
    }
}
