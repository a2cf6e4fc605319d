//! Cameras that move, and the video that they make.

use crate::cli::support::parsers::{Picks, Size, picks, seconds, size};
use crate::error::{Error, Result};
use crate::render::pictures::PictureKind;
use crate::run::models::first_view;
use crate::scene::overview::likely_up;
use crate::scene::spread::quantiles;
use crate::scene::{Camera, Overview};
use crate::scenes::camera_json::views_of_model;
use crate::scenes::camera_path::read_path;
use clap::Args;
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Ending of a video.
const VIDEO_EXTENSION: &str = "mp4";
/// Shares of what is drawn, along each axis, between which the turntable shows it.
const FRAMED_QUANTILES: [f64; 2] = [0.02, 0.98];
/// Focal length of the turntable, in the smaller side of the image, and the least space around what is drawn.
const FOCAL_IN_SIDES: f64 = 1.4;
const FRAME_MARGIN: f64 = 1.1;
/// Height of the eye over what is drawn alone, in distances.
const EYE_HEIGHT_IN_DISTANCES: f64 = 0.35;

/// A camera that moves.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Video")]
pub struct MotionArgs {
    /// Move the camera smoothly through the keyframes of this JSON file: schema_version, fps, and keyframes with a time
    /// in seconds and a camera as for --camera.
    #[arg(long, value_name = "PATH.json")]
    pub path: Option<PathBuf>,
    /// Move the camera once around these labels, drawn alone, or without a value around the whole render.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1)]
    pub turntable: Option<Option<Picks>>,
    /// Duration of --turntable, s.
    #[arg(long, value_name = "S", value_parser = seconds, default_value = "6",
        conflicts_with_all = ["scene", "camera", "path"])]
    pub seconds: f64,
    /// Frames per second of --turntable.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240), default_value_t = 30,
        conflicts_with_all = ["scene", "camera", "path"])]
    pub fps: u32,
    /// Image size of --turntable, px.
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "960x540",
        conflicts_with_all = ["scene", "camera", "path"])]
    pub size: Size,
}

/// Returns true for the path of a video.
pub(super) fn is_video(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(VIDEO_EXTENSION))
}

/// Returns the kind of image in a video; fails for several, and for values that are no colours.
pub(super) fn kind_of_video(what: &[PictureKind]) -> Result<PictureKind> {
    match what {
        [PictureKind::TopId | PictureKind::TopWeight] => Err(Error::usage(
            "--what",
            "top-id and top-weight cannot be a video; use a folder as -o, with --format exr",
        )),
        [one] => Ok(*one),
        _ => Err(Error::usage(
            "--what",
            "a video shows one kind of image; choose one, or use a folder as -o for all of them",
        )),
    }
}

impl MotionArgs {
    /// Returns the frames per second and the cameras of a path, if there is one.
    pub(super) fn path_frames(&self) -> Result<Option<(f64, Vec<Camera>)>> {
        let found = self.path.as_deref().map(read_path).transpose()?;
        Ok(found.map(|found| (found.per_second, found.cameras)))
    }

    /// Returns the cameras of the turntable around points, and the largest near plane that does not cut them. `alone`:
    /// the points belong to objects; otherwise the cameras of the model's run give height and distance.
    pub(super) fn around(
        &self,
        model: &Path,
        places: impl Iterator<Item = DVec3> + Clone,
        alone: bool,
    ) -> Result<(Vec<Camera>, f32)> {
        let [low, high] = quantiles(places.clone(), FRAMED_QUANTILES);
        let first = first_view(model)?;
        let up = first.map_or_else(|| likely_up(places), |view| view.up);
        let Size(width, height) = self.size;
        let focal = FOCAL_IN_SIDES * f64::from(width.min(height));
        let (middle, radius) = (0.5 * (low + high), 0.5 * low.distance(high).max(1e-6));
        let views = if alone { Vec::new() } else { views_of_model(model)? };
        let cameras = || views.iter().map(|view| &view.camera);
        // The cosine makes a ball of the radius touch the edge of the image.
        let distance = FRAME_MARGIN * radius * (2.0 * FOCAL_IN_SIDES).hypot(1.0);
        let (target, distance, raised) = match Overview::from_cameras(cameras()) {
            Some(all) => {
                let heights = cameras().map(|camera| (camera.centre() - all.target).dot(up)).sum::<f64>();
                let share = (heights / views.len() as f64 / all.distance).clamp(-0.9, 0.9);
                (all.target, all.distance, share / (1.0 - share * share).sqrt())
            }
            None => (middle, distance, EYE_HEIGHT_IN_DISTANCES),
        };
        let level = first.and_then(|view| (view.eye - target).reject_from_normalized(up).try_normalize());
        let level = level.unwrap_or_else(|| up.any_orthonormal_vector());
        let lens = [focal, focal, 0.5 * f64::from(width), 0.5 * f64::from(height)];
        let still = Camera::at_origin(lens, (width, height));
        let frames = (self.seconds * f64::from(self.fps)).round().max(1.0) as u32;
        let camera = |frame: u32| {
            let turn = DQuat::from_axis_angle(up, TAU * f64::from(frame) / f64::from(frames));
            let away = (turn * level + raised * up).normalize();
            still.placed(target + away * distance, -away, up)
        };
        let nearest = if alone { (0.5 * (distance - radius)).max(1e-3) } else { f64::INFINITY };
        Ok(((0..frames).map(camera).collect(), nearest as f32))
    }
}
