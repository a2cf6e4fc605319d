//! Records of a COLMAP model, and its camera models.

use crate::error::{Error, Result};
use crate::io::lens::{self, CameraModel, Lens};
use crate::scene::Camera;
use glam::{DMat3, DVec2, DVec3};
use std::path::Path;

/// Names of the camera models; the index is COLMAP's number.
pub(super) const NAMES: [&str; 12] = [
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "OPENCV_FISHEYE",
    "FULL_OPENCV",
    "FOV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "THIN_PRISM_FISHEYE",
    "RAD_TAN_THIN_PRISM_FISHEYE",
];

/// A line of `cameras`.
pub(super) struct CameraRecord {
    pub(super) id: u32,
    pub(super) model: &'static CameraModel,
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) parameters: Vec<f64>,
}

/// Points of a reconstruction as its images show them.
pub(crate) struct Observed {
    /// Position in the photo, px, and id of the point.
    pub(crate) points: Vec<(DVec2, u64)>,
}

/// A line of `images`.
pub(super) struct ImageRecord {
    pub(super) id: u32,
    /// Camera-from-world rotation, (w, x, y, z).
    pub(super) quaternion: [f64; 4],
    pub(super) translation: [f64; 3],
    pub(super) camera: u32,
    pub(super) name: String,
    /// Empty unless asked for.
    pub(super) observed: Observed,
}

/// Returns the camera model of one of [`NAMES`]. Refuses models that cannot be undistorted to a pinhole.
pub(super) fn model_of(path: &Path, place: &str, name: &str) -> Result<&'static CameraModel> {
    lens::model(name).ok_or_else(|| {
        let known: Vec<&str> = NAMES.into_iter().filter(|name| lens::model(name).is_some()).collect();
        let problem = format!(
            "camera model {name} is not supported (supported: {}); run `colmap image_undistorter` and use its output",
            known.join(", ")
        );
        Error::data(path, place, problem)
    })
}

impl CameraRecord {
    /// Returns the intrinsics, with an identity pose, and the lens.
    pub(super) fn intrinsics(&self, path: &Path) -> Result<(Camera, Lens)> {
        let place = format!("camera {}", self.id);
        let CameraModel { name, focals, coefficients, of_list, .. } = *self.model;
        let (p, count) = (&self.parameters, focals + 2 + coefficients);
        if p.len() != count {
            return Err(Error::data(path, place, format!("{name} has {count} parameters, {} are listed", p.len())));
        }
        let side = |side: u64| {
            let problem = || Error::data(path, place.as_str(), format!("image side of {side} px"));
            u32::try_from(side).map_err(|_| problem())
        };
        let (width, height) = (side(self.width)?, side(self.height)?);
        let (fx, fy, cx, cy) = (p[0], p[focals - 1], p[focals], p[focals + 1]);
        let camera = Camera { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, fx, fy, cx, cy, width, height };
        Ok((camera, of_list(&p[focals + 2..])))
    }
}
