//! Records of a COLMAP model and what its camera models mean.

use crate::error::{Error, Result};
use crate::io::lens::Lens;
use crate::scene::Camera;
use glam::{DMat3, DVec3};
use std::path::Path;

/// Camera models by COLMAP's number: name, number of parameters, supported.
pub(super) const MODELS: [(&str, usize, bool); 12] = [
    ("SIMPLE_PINHOLE", 3, true),
    ("PINHOLE", 4, true),
    ("SIMPLE_RADIAL", 4, true),
    ("RADIAL", 5, true),
    ("OPENCV", 8, true),
    ("OPENCV_FISHEYE", 8, false),
    ("FULL_OPENCV", 12, true),
    ("FOV", 5, false),
    ("SIMPLE_RADIAL_FISHEYE", 4, false),
    ("RADIAL_FISHEYE", 5, false),
    ("THIN_PRISM_FISHEYE", 12, false),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16, false),
];

/// A line of `cameras`.
pub(super) struct CameraRecord {
    pub(super) id: u32,
    /// Index into [`MODELS`].
    pub(super) model: usize,
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) parameters: Vec<f64>,
}

/// A line of `images`, without its observations.
pub(super) struct ImageRecord {
    pub(super) id: u32,
    /// (w, x, y, z) of camera-from-world.
    pub(super) quaternion: [f64; 4],
    pub(super) translation: [f64; 3],
    pub(super) camera: u32,
    pub(super) name: String,
}

/// Refuses models that cannot be undone to a pinhole here.
pub(super) fn check_supported(path: &Path, place: &str, model: usize) -> Result<()> {
    let (name, _, supported) = MODELS[model];
    if supported {
        return Ok(());
    }
    let known: Vec<&str> = MODELS.iter().filter(|model| model.2).map(|model| model.0).collect();
    let problem = format!(
        "camera model {name} is not supported (supported: {}); run `colmap image_undistorter` and use its output",
        known.join(", ")
    );
    Err(Error::data(path, place, problem))
}

impl CameraRecord {
    /// Intrinsics with an identity pose, and the lens.
    pub(super) fn intrinsics(&self, path: &Path) -> Result<(Camera, Lens)> {
        let place = format!("camera {}", self.id);
        let (name, count, _) = MODELS[self.model];
        let p = &self.parameters;
        if p.len() != count {
            return Err(Error::data(path, place, format!("{name} has {count} parameters, {} are listed", p.len())));
        }
        let side = |side: u64| {
            let problem = || Error::data(path, place.as_str(), format!("image side of {side} px"));
            u32::try_from(side).map_err(|_| problem())
        };
        let (width, height) = (side(self.width)?, side(self.height)?);
        let two_focals = !matches!(name, "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL");
        let (fx, fy, cx, cy, k) =
            if two_focals { (p[0], p[1], p[2], p[3], &p[4..]) } else { (p[0], p[0], p[1], p[2], &p[3..]) };
        let mut lens = Lens::default();
        match *k {
            [k1] => lens.numerator[0] = k1,
            [k1, k2] => lens.numerator[..2].copy_from_slice(&[k1, k2]),
            [k1, k2, p1, p2] => {
                lens.numerator[..2].copy_from_slice(&[k1, k2]);
                lens.tangential = [p1, p2];
            }
            [k1, k2, p1, p2, k3, k4, k5, k6] => {
                lens = Lens { numerator: [k1, k2, k3, 0.0], denominator: [k4, k5, k6], tangential: [p1, p2] };
            }
            _ => {}
        }
        let camera = Camera { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, fx, fy, cx, cy, width, height };
        Ok((camera, lens))
    }
}
