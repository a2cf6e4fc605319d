//! `labelgs render`.

use crate::cli::support::parsers::{Picks, colour, picks};
use crate::cli::support::{
    Asked, Context, Drawer, MemoryArg, MinConfidenceArg, PromptArgs, SceneArgs, TableArg, largest, model_edit,
    near_plane, open_gpu, open_model, open_scene, pick_views, warn_of_misfit_with,
};
use crate::edit::catalogue::Catalogue;
use crate::edit::select::{nothing_left, remove};
use crate::formats::ModelRef;
use crate::render::large::{Index, fits};
use crate::render::pictures::{Format, What, write_pictures};
use crate::render::{Parts, RenderOptions};
use crate::run::models;
use crate::scene::{Camera, Dataset, Gaussians, LABEL_MAX, stems};
use crate::scenes::camera_json::read_camera;
use crate::stage::Stage;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs render`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("from").required(true).args(["scene", "camera"])))]
pub struct RenderArgs {
    /// The model: a PLY, SPZ, GLB, SOG, USD or .splat, or the folder of a `labelgs train` run.
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
    #[command(flatten)]
    pub table: TableArg,
    /// File format.
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "png", help_heading = "Output")]
    pub format: Format,
    /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    #[command(flatten)]
    pub memory: MemoryArg,
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Renders views.
pub(crate) fn run(args: &RenderArgs, context: &Context) -> Result<()> {
    let exr_only = args.what.iter().find(|what| matches!(what, What::TopId | What::TopWeight));
    if args.format == Format::Png && exr_only.is_some() {
        return Err(Error::usage("--what", "top-id and top-weight are 32-bit values; use --format exr"));
    }
    let source = models::open_lazily(&args.model)?;
    let near = near_plane(&args.model, args.prompts.near)?;
    let (cameras, dataset) = cameras(args)?;
    let sizes = || cameras.iter().map(|(_, camera)| (camera.width, camera.height));
    let (gpu, options) = (open_gpu(context)?, args.memory.options());
    let shown;
    let mut drawer = if fits(&gpu, source.view(), largest(sizes()), options)? {
        shown = self::shown(args, context)?;
        if let (Some(scene), Some(dataset)) = (&args.scene, &dataset) {
            warn_of_misfit_with(&args.model, &shown, (scene, &args.reading.of_run(&args.model)?), dataset)?;
        }
        Drawer::new(gpu, (&shown).into(), sizes(), options)?
    } else {
        let index = index(args, source.view(), context)?;
        Drawer::parts(gpu, source.view(), index, options)
    };
    let wide = wide_labels(args, drawer.largest_label())?;
    let asked = |of: &[What]| args.what.iter().any(|what| of.contains(what));
    let parts = Parts {
        depth: asked(&[What::Depth]),
        main: asked(&[What::TopId, What::TopWeight]),
        labels: asked(&[What::Labels]),
    };
    let clear_labels = args.reading.of_run(&args.model)?.masked_only;
    let options = RenderOptions { background: args.background, clear_labels, ..RenderOptions::new(near, parts) };
    let mut files = Vec::new();
    let stage = Stage::new("rendering", cameras.len());
    for (stem, camera) in &cameras {
        let rendered = drawer.render(camera, &options)?;
        files.extend(write_pictures(&args.output, stem, &rendered, &args.what, (args.format, wide))?);
        stage.count();
    }
    drop(stage);
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let text: String = files.iter().map(|file| format!("{file}\n")).collect();
    context.show(&json!({ "schema_version": 1, "files": files }), &text)
}

/// Returns true if ids of label maps need 32 bits; fails if a PNG was asked for, which has 16.
fn wide_labels(args: &RenderArgs, largest: Option<u32>) -> Result<bool> {
    let Some(label) = largest.filter(|&label| label > LABEL_MAX) else { return Ok(false) };
    if args.format == Format::Png && args.what.contains(&What::Labels) {
        let problem = format!(
            "the model has label {label}, and a 16-bit PNG has no place for ids above {LABEL_MAX}; use --format exr, which \
             writes 32-bit ids, or give the labels smaller ids with `labelgs relabel`"
        );
        return Err(Error::usage("--format", problem));
    }
    Ok(true)
}

/// Returns the visible part of the model.
fn shown(args: &RenderArgs, context: &Context) -> Result<Gaussians> {
    let Some((flag, picks)) = chosen(args)? else { return open_model(&args.model) };
    let (model, known) = model_edit::open(&args.model, &args.table)?;
    let labels = args.prompts.labels(flag, picks, &asked(args, (&model).into(), &known), context)?;
    let labels: Vec<u32> = labels.into_iter().collect();
    if args.only.is_some() { args.sure.extract(&model, &labels) } else { remove(&model, &labels) }
}

/// Returns the visible part of a model that is not read.
fn index(args: &RenderArgs, model: ModelRef, context: &Context) -> Result<Index> {
    let least = args.sure.min_confidence;
    let Some((flag, picks)) = chosen(args)? else {
        let (index, notes) = Index::of(model, least, |_, _| true)?;
        models::log_notes(&args.model, &notes);
        return Ok(index);
    };
    let known = model_edit::look(&args.model, &args.table)?.known;
    let labels = args.prompts.labels(flag, picks, &asked(args, model, &known), context)?;
    let is_sure = |share: Option<f32>| share.is_none_or(|share| share >= least);
    let keep = |label: u32, share: Option<f32>| match args.only {
        Some(_) => labels.contains(&label) && is_sure(share),
        None => !labels.contains(&label),
    };
    let index = Index::of(model, least, keep)?.0;
    match (index.is_empty(), &args.only) {
        (true, Some(_)) => Err(args.sure.nothing()),
        (true, None) => Err(nothing_left()),
        _ => Ok(index),
    }
}

/// Returns the flag of a choice of labels, and the labels in it.
fn chosen(args: &RenderArgs) -> Result<Option<(&'static str, Option<&Picks>)>> {
    match (&args.only, &args.without) {
        (Some(picks), _) => Ok(Some(("--only", picks.as_ref()))),
        (None, Some(picks)) => Ok(Some(("--without", picks.as_ref()))),
        (None, None) if args.prompts.is_empty() => Ok(None),
        (None, None) => {
            let problem = "or --without is needed: it says what to do with the labels that --name, --at, --box or \
                           --mask choose";
            Err(Error::usage("--only", problem))
        }
    }
}

fn asked<'a>(args: &'a RenderArgs, model: ModelRef<'a>, known: &'a Catalogue) -> Asked<'a> {
    let (max_resolution, read) = (args.reading.max_resolution, args.reading.read.clone());
    let reading = SceneArgs { max_resolution, read, ..SceneArgs::default() };
    let (scene, memory) = (args.scene.as_deref(), args.memory.options());
    Asked { path: &args.model, model, known, scene, reading, memory }
}

/// Returns the cameras to draw for, and the scene that has them.
fn cameras(args: &RenderArgs) -> Result<(Vec<(String, Camera)>, Option<Dataset>)> {
    if let Some(path) = &args.camera {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        return Ok((vec![(stem, read_camera(path)?)], None));
    }
    let Some(scene) = &args.scene else { return Err(Error::usage("--scene", "--scene or --camera is needed")) };
    let dataset = open_scene(scene, &args.reading.of_run(&args.model)?, None, args.background, false)?;
    let views = pick_views(&dataset, &args.views)?;
    let cameras = stems(&views).into_iter().zip(&views).map(|(stem, view)| (stem, view.camera.clone())).collect();
    Ok((cameras, Some(dataset)))
}
