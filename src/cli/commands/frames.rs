//! `labelgs frames`: a video through the photos. An object tracker loses fewer objects in it than between the photos.

use crate::cli::support::parsers::{colour, near};
use crate::cli::support::{Context, Progress, SceneArgs, largest, near_plane, open_gpu, open_model, open_scene};
use crate::engine::Engine;
use crate::render::pictures::{Format, write_rgb};
use crate::render::{Parts, RenderOptions, render};
use crate::scene::path::{Interpolation, short_order, video};
use crate::scene::{Camera, Dataset, View};
use crate::scenes::frames::{self, Frame, Frames};
use crate::scenes::window::windows;
use crate::words::counted;
use crate::{Error, Result};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;

/// Order of the photos in the video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Order {
    /// A short path through the poses.
    #[default]
    Path,
    /// By name, as in the paper.
    Name,
}

/// `labelgs frames`.
#[derive(Args, Clone, Debug)]
pub struct FramesArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the photos.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder for frames/NNNNN.png and frames.json.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// Frames between two photos.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(..=999))]
    pub between: u32,
    /// Order of the photos.
    #[arg(long, value_name = "ORDER", value_enum, default_value = "path")]
    pub order: Order,
    /// Reproduce the LabelGS code: order by name, interpolated world-to-camera translations, intrinsics of the previous
    /// photo.
    #[arg(long, conflicts_with = "order")]
    pub compat: bool,
    /// Include the held-out views in the video. The tracked masks then depend on them.
    #[arg(long)]
    pub include_test: bool,
    /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Renders the video.
pub(crate) fn run(args: &FramesArgs, context: &Context) -> Result<()> {
    let (model, near) = (open_model(&args.model)?, near_plane(&args.model, args.near)?);
    let dataset = open_scene(&args.scene, &args.reading, None, args.background, false)?;
    let views = ordered_views(args, &dataset)?;
    let lenses = windows(&args.scene, &args.reading.read.lookup())?.values().any(|window| !window.is_photo());
    // A tracker needs frames of one size. Smaller photos are in the upper left of their frames; the render continues
    // around them.
    let size = largest(views.iter().map(|view| (view.camera.width, view.camera.height)));
    let wide: Vec<Camera> =
        views.iter().map(|view| Camera { width: size.0, height: size.1, ..view.camera.clone() }).collect();
    let cameras: Vec<&Camera> = wide.iter().collect();
    let how = if args.compat { Interpolation::Translations } else { Interpolation::Centres };
    let stops = video(&cameras, args.between, how);
    let gpu = open_gpu(context)?;
    let mut engine = Engine::for_model(gpu, &model, std::iter::once(size))?;
    let options = RenderOptions { background: args.background, ..RenderOptions::new(near, Parts::COLOUR) };
    let mut progress = Progress::new(stops.len() as u64, "frames", &context.global);
    let mut written = Vec::new();
    for (index, stop) in stops.iter().enumerate() {
        let rendered = render(&mut engine, &stop.camera, &options)?;
        let file = format!("frames/{index:05}.png");
        write_rgb(&args.output.join(&file), size, &rendered.rgb, Format::Png)?;
        let shown = stop.camera_index.map(|view| views[view]);
        let of_photo = shown.map(|view| [view.camera.width, view.camera.height]);
        written.push(Frame {
            file,
            photo: shown.map(|view| view.name.clone()),
            size: of_photo.filter(|&[width, height]| (width, height) != size),
            camera: (&stop.camera).into(),
        });
        progress.set(index as u64 + 1, String::new);
    }
    drop(progress);
    let path = args.output.join(frames::FILE_NAME);
    // Written last: its presence means that the video is complete.
    Frames::new(written, lenses).write(&path)?;
    let (path, frames, photos) = (path.display().to_string(), stops.len(), views.len());
    let text = format!("{path}: {} through {}\n", counted(frames, "frame"), counted(photos, "photo"));
    context.show(&json!({ "schema_version": 1, "frames_json": path, "frames": frames, "photos": photos }), &text)
}

/// Returns the views in the order of the video.
fn ordered_views<'a>(args: &FramesArgs, dataset: &'a Dataset) -> Result<Vec<&'a View>> {
    let views: Vec<&View> = if args.include_test { dataset.all() } else { dataset.train.iter().collect() };
    if views.is_empty() {
        let cure = "no view is left; use a larger --test-every or --include-test";
        return Err(Error::data(&args.scene, "", cure));
    }
    if args.compat || args.order == Order::Name {
        return Ok(views);
    }
    let cameras: Vec<&Camera> = views.iter().map(|view| &view.camera).collect();
    Ok(short_order(&cameras).into_iter().map(|index| views[index]).collect())
}
