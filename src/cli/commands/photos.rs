//! `labelgs photos`: a scene from photos without poses, or from a video.

use crate::Result;
use crate::cli::support::{Context, quoted, signals};
use crate::scenes::lens::{CAMERA_MODELS, CameraModel, model};
use crate::scenes::reconstruction::{Made, PHOTOS_MIN, Request, advice, reconstruct};
use crate::words::counted;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// `labelgs photos`.
#[derive(Args, Clone, Debug)]
pub struct PhotosArgs {
    /// Folder of PNG or JPEG photos, without its subfolders; or a video in any format of ffmpeg.
    #[arg(value_name = "PHOTOS|VIDEO")]
    pub source: PathBuf,
    /// New or empty folder for the scene. Photos with poses are linked into it, or copied.
    #[arg(short, long, value_name = "SCENE")]
    pub output: PathBuf,
    /// Maximum number of frames to take from a video, at equal intervals.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u32).range(PHOTOS_MIN as i64..))]
    pub frames: u32,
    /// COLMAP camera model: OPENCV for phones and cameras, OPENCV_FISHEYE for action cameras, PINHOLE for images
    /// without distortion. Photos of the same size share a lens.
    #[arg(long, value_name = "MODEL", default_value = "OPENCV", hide_possible_values = true, value_parser = lens())]
    pub model: &'static CameraModel,
    /// Find and match features on the GPU. Needs a COLMAP built with CUDA.
    #[arg(long)]
    pub gpu: bool,
}

/// Takes the name of a camera model.
fn lens() -> impl TypedValueParser<Value = &'static CameraModel> {
    let names = PossibleValuesParser::new(CAMERA_MODELS.map(|model| model.name));
    names.try_map(|name| model(&name).ok_or("is not a camera model"))
}

/// Most names of photos in a warning.
const NAMED_MAX: usize = 20;

/// Makes the scene.
pub(crate) fn run(args: &PhotosArgs, context: &Context) -> Result<()> {
    let start = Instant::now();
    signals::note_only();
    let request = Request {
        source: args.source.clone(),
        scene: args.output.clone(),
        frames: args.frames,
        model: args.model,
        gpu: args.gpu,
    };
    let made = reconstruct(&request, &signals::check)?;
    warn(&made);
    let (scene, seconds) = (made.scene.display().to_string(), start.elapsed().as_secs_f64());
    let text = format!(
        "{scene}: {} of {} have poses, {}, in {seconds:.0} s\nnext:\n  labelgs check {scene}\n  labelgs train {scene} -o OUT\n",
        made.placed,
        counted(made.photos, "photo"),
        counted(made.points, "point"),
        scene = quoted(&scene),
    );
    let told = json!({
        "schema_version": 1,
        "scene": made.scene.display().to_string(),
        "photos": made.photos,
        "placed": made.placed,
        "left_out": made.left_out,
        "apart": made.apart,
        "points": made.points,
        "seconds": seconds,
    });
    context.show(&told, &text)
}

/// Says which photos are not in the scene, and what to do.
fn warn(made: &Made) {
    if made.left_out.is_empty() {
        return;
    }
    let mut names = made.left_out.iter().take(NAMED_MAX).map(String::as_str).collect::<Vec<_>>().join(", ");
    if made.left_out.len() > NAMED_MAX {
        names += &format!(" and {} more", made.left_out.len() - NAMED_MAX);
    }
    tracing::warn!(
        "{} of {} have no pose and are left out: {names}. {}",
        made.left_out.len(),
        counted(made.photos, "photo"),
        advice()
    );
    if !made.apart.is_empty() {
        tracing::warn!(
            "COLMAP also placed {} in {} that it could not join to the scene: take photos between them",
            counted(made.apart.iter().sum::<usize>(), "photo"),
            counted(made.apart.len(), "group")
        );
    }
}
