//! Panoramas of all directions.

use super::Projection;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Longitude to the right and latitude downwards, radians. The axis is at the centre of the photo, which spans 360
/// degrees horizontally and 180 vertically.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equirectangular;

impl Equirectangular {
    /// Returns fx, fy, cx and cy of a panorama, computed from its width and height, px.
    pub fn intrinsics(width: f64, height: f64) -> [f64; 4] {
        [width / (2.0 * PI), height / PI, width / 2.0, height / 2.0]
    }
}

impl Projection for Equirectangular {
    fn is_valid(&self) -> bool {
        true
    }

    fn project(&self, direction: DVec3) -> DVec2 {
        let DVec3 { x, y, z } = direction;
        DVec2::new(x.atan2(z), y.atan2(x.hypot(z)))
    }

    fn radius(&self, angle: f64) -> f64 {
        angle
    }

    fn reach(&self) -> f64 {
        PI
    }

    fn unproject(&self, point: DVec2, _reach: f64) -> Option<DVec3> {
        let (longitude, latitude) = (point.x, point.y);
        if longitude.abs() > PI || latitude.abs() > FRAC_PI_2 {
            return None;
        }
        let across = latitude.cos();
        Some(DVec3::new(across * longitude.sin(), latitude.sin(), across * longitude.cos()))
    }
}
