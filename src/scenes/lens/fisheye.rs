//! Fisheye lenses of OpenCV, COLMAP and Metashape.

use super::Projection;
use super::polynomial::tangential;
use super::projection::angle_of;
use glam::{DVec2, DVec3};

/// Angles instead of tangents, then a polynomial: a direction at angle a from the axis is at distance a (1 + k1 a^2 +
/// k2 a^4 + k3 a^6 + k4 a^8), plus tangential and thin prism terms.
///
/// COLMAP's FISHEYE, RADIAL_FISHEYE, OPENCV_FISHEYE, THIN_PRISM_FISHEYE (and the simple variants) use the first
/// coefficients. Kannala and Brandt, *A generic camera model* (2006); Weng et al., *Camera calibration with distortion
/// models* (1992).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fisheye {
    /// k1 to k4.
    pub radial: [f64; 4],
    /// p1 and p2 of OpenCV.
    pub tangential: [f64; 2],
    /// Factors of a^2 in x and y: sx1 and sy1.
    pub prism: [f64; 2],
    /// Contribution of y to x: Metashape's b2 over the focal length.
    pub skew: f64,
}

impl Fisheye {
    /// Reads k1 k2 k3 k4, or the first of them.
    pub(super) fn from_radial(list: &[f64]) -> Self {
        let mut radial = [0.0; 4];
        radial.iter_mut().zip(list).for_each(|(to, &from)| *to = from);
        Self { radial, ..Self::default() }
    }

    /// Reads COLMAP's list of the thin prism model: k1 k2 p1 p2 k3 k4 sx1 sy1.
    pub(super) fn from_thin_prism(list: &[f64]) -> Self {
        let at = |index: usize| list.get(index).copied().unwrap_or(0.0);
        Self { radial: [at(0), at(1), at(4), at(5)], tangential: [at(2), at(3)], prism: [at(6), at(7)], skew: 0.0 }
    }
}

impl Projection for Fisheye {
    fn is_valid(&self) -> bool {
        self.radial.iter().chain(&self.tangential).chain(&self.prism).chain([&self.skew]).all(|k| k.is_finite())
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let at = angle_of(direction);
        let (a2, [k1, k2, k3, k4]) = (at.length_squared(), self.radial);
        let radial = 1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4)));
        let at = at * radial + tangential(at, self.tangential) + a2 * DVec2::from_array(self.prism);
        at + DVec2::new(self.skew * at.y, 0.0)
    }

    fn radius(&self, angle: f64) -> f64 {
        let (a2, [k1, k2, k3, k4]) = (angle * angle, self.radial);
        angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
    }
}
