//! `labelgs render`.

use super::args::{JsonFlag, SceneArgs};
use super::choose::{Asked, PromptArgs};
use super::context::{Context, open_model};
use super::labelled::MinConfidenceArg;
use super::scene::{near_plane, open_gpu, open_scene, pick_views};
use super::values::{Picks, colour, picks};
use super::{labelled, stdout};
use crate::edit::select::remove;
use crate::engine::Engine;
use crate::io::camera_json::read_camera;
use crate::render::pictures::{Format, Pictures, What, write_pictures};
use crate::render::{Parts, RenderOptions, Rendered, render};
use crate::scene::{Camera, Gaussians, stems};
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs render`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("from").required(true).args(["scene", "camera"])))]
pub struct RenderArgs {
    /// The model: a PLY, SPZ, GLB, SOG or .splat, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene whose cameras to use.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Which views: test, train, all, or names with commas between.
    #[arg(long, value_name = "VIEWS", default_value = "test", conflicts_with = "camera")]
    pub views: String,
    /// Camera to use instead of a scene: JSON with w2c (4 x 4), fx, fy, cx, cy, W, H.
    #[arg(long, value_name = "CAM.json")]
    pub camera: Option<PathBuf>,
    /// Folder for the pictures, NAME.WHAT.png or .exr.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Pictures to write of each view, with commas between.
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',', default_value = "rgb")]
    pub what: Vec<What>,
    /// Render only these labels, such as 1,4-6,cup, or those that --name, --at, --box and --mask choose.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1, conflicts_with = "without")]
    pub only: Option<Option<Picks>>,
    /// Render all but these labels, or all but those that --name, --at, --box and --mask choose.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1)]
    pub without: Option<Option<Picks>>,
    /// Gaussians of `--only`.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Labels by name and by place.
    #[command(flatten)]
    pub prompts: PromptArgs,
    /// File format.
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "png", help_heading = "Output")]
    pub format: Format,
    /// Colour behind the scene: black, white, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Renders views.
pub(crate) fn run(args: &RenderArgs, context: &Context) -> Result<()> {
    let exr_only = args.what.iter().find(|what| matches!(what, What::TopId | What::TopWeight));
    if args.format == Format::Png && exr_only.is_some() {
        return Err(Error::usage("--what", "top-id and top-weight are 32-bit values; use --format exr"));
    }
    let shown = shown(args, context)?;
    let near = near_plane(&args.model, args.prompts.near)?;
    let cameras = cameras(args)?;
    let gpu = open_gpu(context)?;
    let mut engine = Engine::of_model(gpu, &shown, cameras.iter().map(|(_, camera)| (camera.width, camera.height)))?;
    let asked = |of: &[What]| args.what.iter().any(|what| of.contains(what));
    let parts = Parts {
        depth: asked(&[What::Depth]),
        main: asked(&[What::TopId, What::TopWeight]),
        labels: asked(&[What::Labels]),
    };
    let options = RenderOptions { background: args.background, ..RenderOptions::new(near, parts) };
    let mut files = Vec::new();
    for (stem, camera) in &cameras {
        let rendered = render(&mut engine, camera, &options)?;
        files.extend(write(args, stem, &rendered)?);
    }
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    if context.json || args.json.json {
        return stdout::print_json(&json!({ "schema_version": 1, "files": files }));
    }
    files.iter().try_for_each(|file| stdout::print(&format!("{file}\n")))
}

/// Returns the visible part of the model.
fn shown(args: &RenderArgs, context: &Context) -> Result<Gaussians> {
    let (flag, picks) = match (&args.only, &args.without) {
        (Some(picks), _) => ("--only", picks),
        (None, Some(picks)) => ("--without", picks),
        (None, None) if args.prompts.is_empty() => return open_model(&args.model),
        (None, None) => {
            let problem = "or --without is needed: it says what to do with the labels that --name, --at, --box or \
                           --mask choose";
            return Err(Error::usage("--only", problem));
        }
    };
    let (model, known) = labelled::open(&args.model, &args.prompts.table)?;
    let asked = Asked {
        path: &args.model,
        model: &model,
        known: &known,
        scene: args.scene.as_deref(),
        max_resolution: args.reading.max_resolution,
        read: args.reading.read,
    };
    let labels = args.prompts.labels(flag, picks.as_ref(), &asked, context)?;
    let labels: Vec<u32> = labels.into_iter().collect();
    if args.only.is_some() { args.sure.extract(&model, &labels) } else { remove(&model, &labels) }
}

fn cameras(args: &RenderArgs) -> Result<Vec<(String, Camera)>> {
    if let Some(path) = &args.camera {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        return Ok(vec![(stem, read_camera(path)?)]);
    }
    let Some(scene) = &args.scene else { return Err(Error::usage("--scene", "--scene or --camera is needed")) };
    let dataset = open_scene(scene, &args.reading.of_run(&args.model)?, None, args.background, false)?;
    let views = pick_views(&dataset, &args.views)?;
    Ok(stems(&views).into_iter().zip(&views).map(|(stem, view)| (stem, view.camera.clone())).collect())
}

fn write(args: &RenderArgs, stem: &str, rendered: &Rendered) -> Result<Vec<PathBuf>> {
    let asked = |what| args.what.contains(&what);
    let map = if asked(What::Labels) { Some(rendered.label_map()?) } else { None };
    let pictures = Pictures {
        width: rendered.width,
        height: rendered.height,
        rgb: asked(What::Rgb).then_some(&rendered.rgb),
        depth: asked(What::Depth).then_some(&rendered.depth),
        alpha: asked(What::Alpha).then_some(&rendered.alpha),
        labels: map.as_ref(),
        top_id: asked(What::TopId).then_some(&rendered.top_id),
        top_weight: asked(What::TopWeight).then_some(&rendered.top_weight),
    };
    write_pictures(&args.output, stem, &pictures, args.format)
}
