//! `labelgs masks collect`: from the masks of all frames to those of the photos (E in the paper).

use super::{files_of_photos, write_mask};
use crate::cli::support::{Context, ReadArgs};
use crate::files::resize::same_aspect;
use crate::masks::mask::read_mask;
use crate::scene::LabelMap;
use crate::scenes::frames::{Frame, Frames};
use crate::scenes::window::{Window, ids_of_photo, windows};
use crate::{Error, Result};
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// `labelgs masks collect`.
#[derive(Args, Clone, Debug)]
pub struct CollectArgs {
    /// Folder of tracked id images, PNG, named as the frames: NNNNN.png.
    #[arg(value_name = "TRACKED")]
    pub tracked: PathBuf,
    /// File frames.json of `labelgs frames`.
    #[arg(long, value_name = "FILE")]
    pub frames: PathBuf,
    /// Folder for the masks, which get the names of the photos.
    #[arg(short, long, value_name = "MASKS")]
    pub output: PathBuf,
    /// Scene of the photos; needed if their lenses distort, because masks must match the original photos.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Writes a mask per photo of the video, with the ids of its frame.
pub(crate) fn run(args: &CollectArgs, context: &Context) -> Result<()> {
    let video = Frames::read(&args.frames)?;
    if !args.tracked.is_dir() {
        return Err(Error::data(&args.tracked, "", "this folder of tracked masks does not exist"));
    }
    let frames: Vec<&Frame> = video.frames.iter().filter(|frame| frame.photo.is_some()).collect();
    let sources: Vec<PathBuf> = frames.iter().map(|frame| tracked_file(&args.tracked, frame)).collect();
    let missing: Vec<&PathBuf> = sources.iter().filter(|path| !path.is_file()).collect();
    if let Some(first) = missing.first() {
        let problem = format!(
            "{} of {} photos have no tracked mask, such as {}; run the tracker on all frames and keep their names",
            missing.len(),
            frames.len(),
            first.display()
        );
        return Err(Error::data(&args.tracked, "", problem));
    }
    let windows = windows_of(args, &video)?;
    let names = frames.iter().filter_map(|frame| frame.photo.as_deref());
    let photos = files_of_photos(names, &windows, &args.frames)?;
    let written: Vec<Result<()>> = photos
        .par_iter()
        .map(|(file, views)| {
            let maps = views.iter().map(|&at| ids_of(&sources[at], frames[at])).collect::<Result<Vec<_>>>()?;
            let shown = views.iter().filter_map(|&at| windows.get(frames[at].photo.as_ref()?));
            let parts: Vec<(&Window, &LabelMap)> = shown.zip(&maps).collect();
            // Without windows each photo is its only view.
            let bent = ids_of_photo(&parts);
            bent.as_ref().or(maps.first()).map_or(Ok(()), |mask| write_mask(&args.output.join(file), mask))
        })
        .collect();
    written.into_iter().collect::<Result<()>>()?;
    let masks: Vec<String> = photos.keys().map(|file| args.output.join(file).display().to_string()).collect();
    let text = format!("{}: {} masks\n", args.output.display(), masks.len());
    context.show(&json!({ "schema_version": 1, "masks": masks }), &text)
}

fn tracked_file(folder: &Path, frame: &Frame) -> PathBuf {
    let stem = Path::new(&frame.file).file_stem().unwrap_or_default().to_string_lossy();
    folder.join(format!("{stem}.png"))
}

/// Returns how views map to distorted photos; empty if all cameras are pinhole cameras.
fn windows_of(args: &CollectArgs, video: &Frames) -> Result<BTreeMap<String, Window>> {
    let found = match &args.scene {
        Some(scene) => windows(scene, &args.read.lookup())?,
        None if video.lenses => {
            return Err(Error::usage("--scene", "is needed: the photos of this video have lens distortion"));
        }
        None => return Ok(BTreeMap::new()),
    };
    let mut names = video.frames.iter().filter_map(|frame| frame.photo.as_ref());
    match names.find(|&name| !found.contains_key(name)) {
        Some(name) => Err(Error::data(&args.frames, format!("photo {name}"), "is not in the scene of `--scene`")),
        None => Ok(found),
    }
}

/// Returns the ids of the photo, or of the face of a photo, that a frame shows.
fn ids_of(source: &Path, frame: &Frame) -> Result<LabelMap> {
    let ids = read_mask(source)?;
    let (found, expected) = ((ids.width, ids.height), (frame.camera.width, frame.camera.height));
    if !same_aspect(found, expected) {
        let problem = format!(
            "has {} x {} px and its frame {} x {} px, with another aspect ratio; track frames at their original size",
            found.0, found.1, expected.0, expected.1
        );
        return Err(Error::data(source, "", problem));
    }
    let [width, height] = frame.size.unwrap_or([expected.0, expected.1]);
    let scaled = |side: u32, found: u32, whole: u32| (f64::from(side) * f64::from(found) / f64::from(whole)).round();
    let (width, height) = (scaled(width, found.0, expected.0) as u32, scaled(height, found.1, expected.1) as u32);
    Ok(ids.upper_left(width.max(1), height.max(1)))
}
