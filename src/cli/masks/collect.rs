//! `labelgs masks collect`: from the masks of all frames to those of the photos (E in the paper).

use crate::cli::args::JsonFlag;
use crate::cli::context::Context;
use crate::cli::stdout;
use crate::io::frames::{Frame, Frames};
use crate::io::image::write_png_grey16;
use crate::io::mask::{mask_size_fits, read_mask};
use crate::{Error, Result};
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use std::path::{Component, Path, PathBuf};

/// `labelgs masks collect`.
#[derive(Args, Clone, Debug)]
pub struct CollectArgs {
    /// Folder of id images, PNG, named as the frames: NNNNN.png.
    #[arg(value_name = "TRACKED")]
    pub tracked: PathBuf,
    /// The frames.json of `labelgs densify`.
    #[arg(long, value_name = "FILE")]
    pub frames: PathBuf,
    /// Folder for the masks, named as the photos.
    #[arg(short, long, value_name = "MASKS")]
    pub output: PathBuf,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Writes a mask per photo of the video, with the ids of its frame.
pub(crate) fn run(args: &CollectArgs, context: &Context) -> Result<()> {
    let video = Frames::read(&args.frames)?;
    if !args.tracked.is_dir() {
        return Err(Error::data(&args.tracked, "", "this folder of tracked masks does not exist"));
    }
    let photos: Vec<(&Frame, &str)> =
        video.frames.iter().filter_map(|frame| Some((frame, frame.photo.as_deref()?))).collect();
    let sources: Vec<PathBuf> = photos.iter().map(|(frame, _)| tracked_file(&args.tracked, frame)).collect();
    let missing: Vec<&PathBuf> = sources.iter().filter(|path| !path.is_file()).collect();
    if let Some(first) = missing.first() {
        let problem = format!(
            "{} of {} photos have no tracked mask, such as {}; run the tracker on all frames and keep their names",
            missing.len(),
            photos.len(),
            first.display()
        );
        return Err(Error::data(&args.tracked, "", problem));
    }
    let targets: Vec<PathBuf> = photos.iter().map(|(_, name)| target(args, name)).collect::<Result<_>>()?;
    if let Some(twice) = targets.iter().enumerate().find(|(at, path)| targets[..*at].contains(path)) {
        let problem =
            format!("two photos would have the mask {}; their names differ in the extension only", twice.1.display());
        return Err(Error::data(&args.frames, "photos", problem));
    }
    let written: Vec<Result<()>> = (0..photos.len())
        .into_par_iter()
        .map(|index| collect(&sources[index], photos[index].0, &targets[index]))
        .collect();
    written.into_iter().collect::<Result<()>>()?;
    if context.json || args.json.json {
        let masks: Vec<String> = targets.iter().map(|path| path.display().to_string()).collect();
        return stdout::print_json(&json!({ "schema_version": 1, "masks": masks }));
    }
    stdout::print(&format!("{}: {} masks\n", args.output.display(), targets.len()))
}

fn tracked_file(folder: &Path, frame: &Frame) -> PathBuf {
    let stem = Path::new(&frame.file).file_stem().unwrap_or_default().to_string_lossy();
    folder.join(format!("{stem}.png"))
}

/// Returns the path of a photo's mask: the photo's name, ending in `.png`.
fn target(args: &CollectArgs, name: &str) -> Result<PathBuf> {
    let path = Path::new(name).with_extension("png");
    if path.components().all(|part| matches!(part, Component::Normal(_))) {
        return Ok(args.output.join(path));
    }
    Err(Error::data(&args.frames, format!("photo {name}"), "would lie outside the folder of masks"))
}

fn collect(source: &Path, frame: &Frame, target: &Path) -> Result<()> {
    let ids = read_mask(source)?;
    let (found, expected) = ((ids.width, ids.height), (frame.camera.width, frame.camera.height));
    if !mask_size_fits(found, expected) {
        let problem = format!(
            "has {} x {} px and its frame {} x {} px, which is another shape; track the frames in their own size",
            found.0, found.1, expected.0, expected.1
        );
        return Err(Error::data(source, "", problem));
    }
    write_png_grey16(target, ids.width, ids.height, &ids.ids)
}
