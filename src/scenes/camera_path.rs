//! Camera paths as JSON: keyframes along a smooth curve.

use super::camera_json::{CameraFile, camera_of};
use labelgs_files::read;
use labelgs_scene::keyframes::CameraPath;
use labelgs_scene::{Camera, Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

const SCHEMA_VERSION: u32 = 1;

/// The content of a file.
#[derive(Debug, Deserialize, Serialize)]
struct File {
    schema_version: u32,
    /// Frames per second of the video.
    fps: f64,
    keyframes: Vec<Keyframe>,
}

#[derive(Debug, Deserialize, Serialize)]
struct Keyframe {
    /// Time in seconds, increasing between keyframes.
    time: f64,
    camera: CameraFile,
}

/// A video along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFrames {
    /// Frames per second.
    pub per_second: f64,
    /// The cameras of the frames, all of the same size.
    pub cameras: Vec<Camera>,
}

/// Reads a path: `{"schema_version": 1, "fps": 30, "keyframes": [{"time": s, "camera": {..}}, ..]}`, with cameras as
/// [`read_camera`](super::read_camera) reads them. Times must increase, and all cameras must have the same size.
pub fn read_path(path: &Path) -> Result<PathFrames> {
    let expected = r#"expected {"schema_version": 1, "fps": 30, "keyframes": [{"time": 0.0, "camera": {"w2c", "fx", "fy", "cx", "cy", "W", "H"}}, ..]}"#;
    let file: File = read::json(path, expected)?;
    read::require_version(path, file.schema_version, SCHEMA_VERSION)?;
    let camera = |(at, key): (usize, &Keyframe)| match camera_of(path, &key.camera) {
        Err(Error::Data { path, place, problem }) => {
            Err(Error::data(path, format!("keyframe {at}: {place}").trim_end_matches([' ', ':']), problem))
        }
        other => other.map(|camera| (key.time, camera)),
    };
    let keyframes = file.keyframes.iter().enumerate().map(camera).collect::<Result<_>>()?;
    let curve = CameraPath::new(keyframes).map_err(|problem| Error::data(path, "keyframes", problem))?;
    let cameras = curve.frames(file.fps).map_err(|problem| Error::data(path, "fps", problem))?;
    Ok(PathFrames { per_second: file.fps, cameras })
}
