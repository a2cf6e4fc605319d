//! A scene of photos without poses, or of a video: ffmpeg takes the frames, COLMAP finds lens, poses and points.
//!
//! All work is done in a folder beside the scene, which appears whole or not at all.

mod attempts;
mod options;
mod progress;
mod sources;
mod workshop;

use crate::lens::CameraModel;
use labelgs_files::atomic;
use labelgs_files::program::{COLMAP, Check};
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Result, Setting};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use workshop::Workshop;

/// Fewest photos that make a scene.
pub const PHOTOS_MIN: usize = 3;

/// What to make a scene of.
#[derive(Clone, Debug)]
pub struct Request {
    /// A folder of photos, or a video.
    pub source: PathBuf,
    /// The folder of the scene; new or empty.
    pub scene: PathBuf,
    /// Most frames to take of a video.
    pub frames: u32,
    /// The lens model; photos of one size share its parameters.
    pub model: &'static CameraModel,
    /// Finds and compares features on a GPU, which needs a COLMAP that was built with CUDA.
    pub gpu: bool,
}

/// A scene that was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Made {
    /// Its folder.
    pub scene: PathBuf,
    /// Number of photos, or of frames of the video.
    pub photos: usize,
    /// Number of photos that have poses and are in the scene.
    pub placed: usize,
    /// Names of the photos without a pose, sorted. They are not in the scene.
    pub left_out: Vec<String>,
    /// Sizes of further groups of photos that have poses, but none in common with the scene.
    pub apart: Vec<usize>,
    /// Number of points.
    pub points: usize,
}

/// Makes a scene. `check` is asked all the time; its error ends the work.
pub fn reconstruct(request: &Request, check: &Check) -> Result<Made> {
    if !request.source.exists() {
        let problem = "there is no such file or folder; expected a folder of photos or a video";
        return Err(Error::data(&request.source, "", problem));
    }
    atomic::require_empty("output", &request.scene)?;
    let colmap = COLMAP.find().ok_or_else(|| {
        let problem = format!(
            "no folder of it holds {}, which finds the poses of photos. Install it ({}), or find the poses with another \
             program that writes COLMAP's files, transforms.json of nerfstudio, or cameras of Metashape",
            COLMAP.name,
            COLMAP.how_to_install()
        );
        Error::usage("PATH", problem)
    })?;
    let mut workshop = Workshop::new(request, colmap, check)?;
    let photos = sources::gather(&mut workshop)?;
    let count = photos.count();
    let best = attempts::best_of_all(&mut workshop, &photos)?;
    let placed: BTreeSet<&str> = best.contents.photos.iter().map(String::as_str).collect();
    let mut left_out = photos.damaged.clone();
    for name in photos.names().filter(|name| !placed.contains(name)) {
        let photo = workshop.images().join(name);
        fs::remove_file(&photo).map_err(Error::write(&photo))?;
        left_out.push(name.to_owned());
    }
    left_out.sort();
    let (placed, points) = (placed.len(), best.contents.points);
    workshop.finish(&best.folder)?;
    Ok(Made { scene: request.scene.clone(), photos: count, placed, left_out, apart: best.apart, points })
}

/// The error for photos of which none has a pose. `last_lines` are those of COLMAP.
fn unplaced(source: &Path, photos: usize, last_lines: &str) -> Error {
    let problem = format!(
        "COLMAP found no poses for its {}. {} COLMAP's last lines:{last_lines}",
        counted(photos, "photo"),
        advice()
    );
    Error::data(source, "", problem)
}

/// What to do when photos have no pose.
pub fn advice() -> String {
    format!(
        "Neighbouring photos must overlap by more than half, be sharp, and show texture: bare walls, glass and sky have \
         none. Take more photos, move less between two of them, or take more frames of a video ({}).",
        Setting("frames")
    )
}
