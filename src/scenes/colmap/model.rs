//! Records of a COLMAP model, and its camera models.

use crate::lens::{self, CameraModel, Lens};
use glam::DVec2;
use labelgs_scene::{Camera, Error, Result};
use std::fmt::Display;
use std::path::Path;

/// A line of `cameras`.
pub(super) struct CameraRecord {
    pub(super) id: u32,
    pub(super) model: &'static CameraModel,
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) parameters: Vec<f64>,
}

/// A line of `images`.
pub(super) struct ImageRecord {
    pub(super) id: u32,
    /// Camera-from-world rotation, (w, x, y, z).
    pub(super) quaternion: [f64; 4],
    pub(super) translation: [f64; 3],
    pub(super) camera: u32,
    pub(super) name: String,
    /// Positions in the photo, px, with the ids of the points there; empty unless requested.
    pub(super) observed: Vec<(DVec2, u64)>,
}

/// Creates the error for a camera model unknown to COLMAP.
pub(super) fn unknown_model(path: &Path, place: String, name: &dyn Display) -> Error {
    let known = lens::CAMERA_MODELS.map(|model| model.name).join(", ");
    Error::data(path, place, format!("the camera model {name} is unknown; expected one of {known}"))
}

impl CameraRecord {
    /// Returns the intrinsics, with an identity pose, and the lens.
    pub(super) fn intrinsics(&self, path: &Path) -> Result<(Camera, Lens)> {
        let place = format!("camera {}", self.id);
        let CameraModel { name, coefficients, from_list, .. } = *self.model;
        let (p, before) = (&self.parameters, self.model.before());
        let count = before + coefficients;
        if p.len() != count {
            return Err(Error::data(path, place, format!("{name} has {count} parameters, but {} are listed", p.len())));
        }
        let side = |side: u64| {
            let problem = || Error::data(path, place.as_str(), format!("image side of {side} px"));
            u32::try_from(side).map_err(|_| problem())
        };
        let (width, height) = (side(self.width)?, side(self.height)?);
        if self.model.focals == 0 && p[..2] != [f64::from(width), f64::from(height)] {
            let problem = format!("{name} with {width} x {height} px has the parameters {p:?}; expected its size");
            return Err(Error::data(path, place, problem));
        }
        Ok((Camera::at_origin(self.model.intrinsics(p), (width, height)), from_list(&p[before..])))
    }
}
