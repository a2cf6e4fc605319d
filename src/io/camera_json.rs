//! Single cameras as JSON, and the `cameras.json` that 3DGS viewers read.

use super::atomic;
use super::lens::Lens;
use super::listing::{check_camera, rotation_of};
use super::transforms::affine;
use crate::error::{Error, Result};
use crate::io::read;
use crate::scene::Camera;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A camera in the JSON layout of `labelgs render --camera`.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct CameraFile {
    /// Camera-from-world, 4 x 4, row-major, OpenCV axes.
    pub w2c: Vec<Vec<f64>>,
    /// Horizontal focal length, px.
    pub fx: f64,
    /// Vertical focal length, px.
    pub fy: f64,
    /// Principal point x, px; the centre of the first pixel is at 0.5.
    pub cx: f64,
    /// Principal point y, px.
    pub cy: f64,
    /// Width, px.
    #[serde(rename = "W")]
    pub width: u32,
    /// Height, px.
    #[serde(rename = "H")]
    pub height: u32,
}

impl From<&Camera> for CameraFile {
    fn from(camera: &Camera) -> Self {
        let row = |axis: usize| {
            let row = camera.rotation.row(axis);
            vec![row.x, row.y, row.z, camera.translation[axis]]
        };
        let Camera { fx, fy, cx, cy, width, height, .. } = *camera;
        Self { w2c: vec![row(0), row(1), row(2), vec![0.0, 0.0, 0.0, 1.0]], fx, fy, cx, cy, width, height }
    }
}

/// Reads a camera: `{"w2c": 4x4 row-major with OpenCV axes, "fx", "fy", "cx", "cy", "W", "H"}`.
pub fn read_camera(path: impl AsRef<Path>) -> Result<Camera> {
    let path = path.as_ref();
    let text = read::text(path)?;
    let file: CameraFile = serde_json::from_str(&text).map_err(|error| {
        let expected = "expected {\"w2c\": 4x4 rows, \"fx\", \"fy\", \"cx\", \"cy\", \"W\", \"H\"}";
        Error::data(path, format!("line {}", error.line()), format!("{error}; {expected}"))
    })?;
    camera_of(path, &file)
}

/// Returns the camera, checked. Errors name `path`, where it came from.
pub(crate) fn camera_of(path: &Path, file: &CameraFile) -> Result<Camera> {
    let refuse =
        || Error::data(path, "w2c", "is not a camera-from-world pose: 4 x 4 numbers, the upper left 3 x 3 a rotation");
    let pose = affine(&file.w2c).ok_or_else(refuse)?;
    let rotation = rotation_of(pose.matrix3).ok_or_else(refuse)?;
    // A pose with a scale would need a scaled translation too. No known program writes one.
    if (pose.matrix3.determinant() - 1.0).abs() > 1e-2 {
        return Err(refuse());
    }
    let CameraFile { fx, fy, cx, cy, width, height, .. } = *file;
    let camera = Camera { rotation, translation: pose.translation, fx, fy, cx, cy, width, height };
    check_camera(path, "", &camera, &Lens::default())?;
    Ok(camera)
}

/// An entry of `cameras.json`: the fields in the order of 3DGS, then the principal point.
#[derive(Debug, Serialize)]
struct Entry<'a> {
    id: usize,
    img_name: &'a str,
    width: u32,
    height: u32,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fy: f64,
    fx: f64,
    cx: f64,
    cy: f64,
}

/// Writes the `cameras.json` of 3DGS: name, size, centre and world-from-camera rotation (rows) of each camera.
pub fn write_cameras<'a>(path: impl AsRef<Path>, cameras: &[(&'a str, &Camera)]) -> Result<()> {
    let entry = |(id, &(img_name, camera)): (usize, &(&'a str, &Camera))| Entry {
        id,
        img_name,
        width: camera.width,
        height: camera.height,
        position: camera.centre().to_array(),
        // Columns of camera-from-world are rows of world-from-camera.
        rotation: camera.rotation.to_cols_array_2d(),
        fy: camera.fy,
        fx: camera.fx,
        cx: camera.cx,
        cy: camera.cy,
    };
    let entries: Vec<Entry> = cameras.iter().enumerate().map(entry).collect();
    atomic::write(path, |out| Ok(serde_json::to_writer_pretty(out, &entries)?))
}
