//! `frames.json`: the frames of a video through a scene's photos, and the photo of each frame that has one.

use super::camera_json::CameraFile;
use labelgs_files::{atomic, read};
use labelgs_scene::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// Name of the file in the video folder.
pub const FILE_NAME: &str = "frames.json";
const SCHEMA_VERSION: u32 = 1;

/// A frame of the video.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Frame {
    /// Its image, relative to the folder of the file.
    pub file: String,
    /// Name of the photo or cube face with the same pose; null between photos.
    pub photo: Option<String>,
    /// Width and height of the photo, px, at the upper left of the frame; if absent, the photo fills the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// The camera, in the layout of `labelgs render --camera`.
    pub camera: CameraFile,
}

/// The frames of a video, in order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Frames {
    /// Version of the layout.
    pub schema_version: u32,
    /// Whether photos were taken through lenses, so that their masks do not match a pinhole camera.
    #[serde(default)]
    pub lenses: bool,
    /// The frames.
    pub frames: Vec<Frame>,
}

impl Frames {
    /// Creates a video of these frames.
    pub fn new(frames: Vec<Frame>, lenses: bool) -> Self {
        Self { schema_version: SCHEMA_VERSION, lenses, frames }
    }

    /// Reads the file. Another version, a photo with two frames or larger than its frame, and a video without photos
    /// are errors.
    pub fn read(path: &Path) -> Result<Self> {
        let expected = r#"expected {"schema_version": 1, "frames": [{"file", "photo", "camera"}]}"#;
        let video: Self = read::json(path, expected)?;
        read::require_version(path, video.schema_version, SCHEMA_VERSION)?;
        let inside = |frame: &Frame| {
            frame.size.is_none_or(|[width, height]| {
                (1..=frame.camera.width).contains(&width) && (1..=frame.camera.height).contains(&height)
            })
        };
        if let Some(frame) = video.frames.iter().find(|frame| !inside(frame)) {
            return Err(Error::data(path, format!("frame {}", frame.file), "has a `size` larger than its camera"));
        }
        let mut seen = BTreeSet::new();
        for name in video.frames.iter().filter_map(|frame| frame.photo.as_deref()) {
            if !seen.insert(name) {
                return Err(Error::data(path, format!("photo {name}"), "has two frames"));
            }
        }
        if seen.is_empty() {
            return Err(Error::data(path, "frames", "no frame has the pose of a photo"));
        }
        Ok(video)
    }

    /// Writes the file atomically.
    pub fn write(&self, path: &Path) -> Result<()> {
        atomic::write_json(path, self)
    }
}
