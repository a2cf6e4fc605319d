//! `labelgs render`.

mod motion;

use crate::cli::support::parsers::{Picks, colour, picks};
use crate::cli::support::{
    Context, Drawer, LabelQuery, MemoryArg, MinConfidenceArg, PromptArgs, SceneArgs, TableArg, largest, model_edit,
    near_plane, open_gpu, open_model, open_scene, pick_views, warn_of_misfit_with,
};
use crate::edit::catalogue::Catalogue;
use crate::edit::select::{nothing_left, remove};
use crate::files::video;
use crate::formats::ModelRef;
use crate::render::large::{GaussianIndex, fits};
use crate::render::pictures::{Format, PictureKind, frame, write_pictures};
use crate::render::{Parts, RenderOptions};
use crate::run::models;
use crate::scene::{Camera, Dataset, Gaussians, LABEL_MAX, stems};
use crate::scenes::camera_json::read_camera;
use crate::stage::Stage;
use crate::{Error, Result};
use clap::Args;
use glam::DVec3;
use motion::{MotionArgs, is_video, kind_of_video};
use serde_json::json;
use std::path::PathBuf;

/// `labelgs render`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("from").required(true).args(["scene", "camera", "path", "turntable"])))]
pub struct RenderArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the cameras.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Views: test, train, all, or comma-separated names.
    #[arg(long, value_name = "VIEWS", default_value = "test",
        conflicts_with_all = ["camera", "path", "turntable"])]
    pub views: String,
    /// Camera file to use instead of a scene: JSON with w2c (4 x 4), fx, fy, cx, cy, W, H.
    #[arg(long, value_name = "CAM.json")]
    pub camera: Option<PathBuf>,
    /// Folder for the images, NAME.WHAT.png or .exr (00000.WHAT.png and so on with --path and --turntable). With --path
    /// or --turntable also a video, CLIP.mp4, which needs ffmpeg.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Comma-separated kinds of image to write.
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',', default_value = "rgb")]
    pub what: Vec<PictureKind>,
    /// Render only these labels, such as 1,4-6,cup, or without a value the labels selected by --name, --at, --box and
    /// --mask.
    #[arg(long, value_name = "LABELS", value_parser = picks, num_args = 0..=1, conflicts_with = "without")]
    pub only: Option<Option<Picks>>,
    /// Render all but these labels, or without a value all but the labels selected by --name, --at, --box and --mask.
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
    /// File format of the images.
    #[arg(long, value_name = "FORMAT", value_enum, default_value = "png", help_heading = "Output")]
    pub format: Format,
    /// Colour behind the scene: a name such as white, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour, default_value = "black", help_heading = "Rendering")]
    pub background: [f32; 3],
    #[command(flatten)]
    pub motion: MotionArgs,
    #[command(flatten)]
    pub memory: MemoryArg,
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// The views to draw.
#[derive(Default)]
struct Shots {
    /// Cameras by the stem of the image.
    cameras: Vec<(String, Camera)>,
    /// The scene that has them.
    dataset: Option<Dataset>,
    /// Frames per second of a video.
    per_second: Option<f64>,
}

/// Renders views.
pub(crate) fn run(args: &RenderArgs, context: &Context) -> Result<()> {
    let exr_only = args.what.iter().find(|what| matches!(what, PictureKind::TopId | PictureKind::TopWeight));
    if args.format == Format::Png && exr_only.is_some() {
        return Err(Error::usage("--what", "top-id and top-weight are 32-bit values; use --format exr"));
    }
    let source = models::open_lazily(&args.model)?;
    let mut near = near_plane(&args.model, args.prompts.near)?;
    let mut shots = shots(args)?;
    if is_video(&args.output) {
        check_video(args, &shots)?;
    }
    let turning = args.motion.turntable.as_ref().map(|_| sized(args, (args.motion.size.0, args.motion.size.1)));
    let size = largest(shots.cameras.iter().map(|(_, camera)| camera.size()).chain(turning));
    let (gpu, options) = (open_gpu(context)?, args.memory.options());
    let shown;
    let mut drawer = if fits(&gpu, source.view(), size, options)? {
        shown = self::shown(args, context)?;
        near = turn(args, &mut shots, near, (0..shown.len()).map(|row| shown.world(row)))?;
        if let (Some(scene), Some(dataset)) = (&args.scene, &shots.dataset) {
            warn_of_misfit_with(&args.model, &shown, (scene, &args.reading.of_run(&args.model)?), dataset)?;
        }
        Drawer::new(gpu, (&shown).into(), std::iter::once(size), options)?
    } else {
        let index = index(args, source.view(), context)?;
        near = turn(args, &mut shots, near, index.places())?;
        Drawer::parts(gpu, source.view(), index, options)
    };
    let files = draw(args, &shots, &mut drawer, near)?;
    let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let text: String = files.iter().map(|file| format!("{file}\n")).collect();
    context.show(&json!({ "schema_version": 1, "files": files }), &text)
}

/// Returns the size of an image of this size, px. Sides of a video are even, because its colours have half of them.
fn sized(args: &RenderArgs, (width, height): (u32, u32)) -> (u32, u32) {
    if is_video(&args.output) { (width.next_multiple_of(2), height.next_multiple_of(2)) } else { (width, height) }
}

/// Puts the cameras around what is drawn, if those are wanted. Returns a near plane that does not cut it.
fn turn(args: &RenderArgs, shots: &mut Shots, near: f32, places: impl Iterator<Item = DVec3> + Clone) -> Result<f32> {
    if args.motion.turntable.is_none() {
        return Ok(near);
    }
    let alone = chosen(args)?.is_some_and(|choice| choice.alone);
    let (cameras, nearest) = args.motion.around(&args.model, places, alone)?;
    shots.cameras = numbered(args, cameras);
    Ok(near.min(nearest))
}

/// Returns cameras of frames with their numbers; with a column or row more where a video needs it.
fn numbered(args: &RenderArgs, cameras: Vec<Camera>) -> Vec<(String, Camera)> {
    let wide = |camera: Camera| {
        let (width, height) = sized(args, camera.size());
        Camera { width, height, ..camera }
    };
    cameras.into_iter().enumerate().map(|(at, camera)| (format!("{at:05}"), wide(camera))).collect()
}

/// Refuses what no video can be made of, before any work.
fn check_video(args: &RenderArgs, shots: &Shots) -> Result<()> {
    if shots.per_second.is_none() {
        let problem = "a video needs --path or --turntable; use a folder for images of single views";
        return Err(Error::usage("--output", problem));
    }
    kind_of_video(&args.what)?;
    if args.format == Format::Exr {
        return Err(Error::usage("--format", "a video has 8-bit colours; use a folder as -o for EXR"));
    }
    video::find_encoder(&args.output).map(drop)
}

/// Draws the views into files, and returns these.
fn draw(args: &RenderArgs, shots: &Shots, drawer: &mut Drawer, near: f32) -> Result<Vec<PathBuf>> {
    let asked = |of: &[PictureKind]| args.what.iter().any(|what| of.contains(what));
    let parts = Parts {
        depth: asked(&[PictureKind::Depth]),
        main: asked(&[PictureKind::TopId, PictureKind::TopWeight]),
        labels: asked(&[PictureKind::Labels]),
    };
    let clear_labels = args.reading.of_run(&args.model)?.masked_only;
    let options = RenderOptions { background: args.background, clear_labels, ..RenderOptions::new(near, parts) };
    let stage = Stage::new("rendering", shots.cameras.len());
    let Some((per_second, first)) = shots.per_second.zip(shots.cameras.first()).filter(|_| is_video(&args.output))
    else {
        let wide = wide_labels(args, drawer.largest_label())?;
        let mut files = Vec::new();
        for (stem, camera) in &shots.cameras {
            let rendered = drawer.render(camera, &options)?;
            files.extend(write_pictures(&args.output, stem, &rendered, &args.what, (args.format, wide))?);
            stage.count();
        }
        return Ok(files);
    };
    let (what, mut depths) = (kind_of_video(&args.what)?, None);
    video::write(&args.output, first.1.size(), per_second, |push| {
        shots.cameras.iter().try_for_each(|(_, camera)| {
            push(&frame(&drawer.render(camera, &options)?, what, &mut depths)?)?;
            stage.count();
            Ok(())
        })
    })?;
    Ok(vec![args.output.clone()])
}

/// Returns true if ids of label maps need 32 bits; fails if a PNG was asked for, which has 16.
fn wide_labels(args: &RenderArgs, largest: Option<u32>) -> Result<bool> {
    let Some(label) = largest.filter(|&label| label > LABEL_MAX) else { return Ok(false) };
    if args.format == Format::Png && args.what.contains(&PictureKind::Labels) {
        let problem = format!(
            "the model has label {label}, and a 16-bit PNG holds ids up to {LABEL_MAX}; use --format exr for 32-bit \
             ids, or run `labelgs relabel` to assign smaller ids"
        );
        return Err(Error::usage("--format", problem));
    }
    Ok(true)
}

/// Returns the visible part of the model.
fn shown(args: &RenderArgs, context: &Context) -> Result<Gaussians> {
    let Some(Choice { flag, picks, alone }) = chosen(args)? else { return open_model(&args.model) };
    let (model, known) = model_edit::open(&args.model, &args.table)?;
    let labels = args.prompts.labels(flag, picks, &asked(args, (&model).into(), &known), context)?;
    let labels: Vec<u32> = labels.into_iter().collect();
    if alone { args.sure.extract(&model, &labels) } else { remove(&model, &labels) }
}

/// Returns the visible part of a model that is not read.
fn index(args: &RenderArgs, model: ModelRef, context: &Context) -> Result<GaussianIndex> {
    let least = args.sure.min_confidence;
    let Some(Choice { flag, picks, alone }) = chosen(args)? else {
        let (index, notes) = GaussianIndex::new(model, least, |_, _| true)?;
        models::log_notes(&args.model, &notes);
        return Ok(index);
    };
    let known = model_edit::look(&args.model, &args.table)?.known;
    let labels = args.prompts.labels(flag, picks, &asked(args, model, &known), context)?;
    let is_sure = |share: Option<f32>| share.is_none_or(|share| share >= least);
    let keep = |label: u32, share: Option<f32>| match alone {
        true => labels.contains(&label) && is_sure(share),
        false => !labels.contains(&label),
    };
    let index = GaussianIndex::new(model, least, keep)?.0;
    match (index.is_empty(), alone) {
        (true, true) => Err(args.sure.nothing()),
        (true, false) => Err(nothing_left()),
        _ => Ok(index),
    }
}

/// The choice of visible labels.
struct Choice<'a> {
    /// The flag that says it.
    flag: &'static str,
    picks: Option<&'a Picks>,
    /// These alone, or all others.
    alone: bool,
}

/// Returns the choice of labels, if there is one.
fn chosen(args: &RenderArgs) -> Result<Option<Choice<'_>>> {
    let turned = args.motion.turntable.as_ref().and_then(Option::as_ref);
    let alone = [("--turntable", turned.map(Some)), ("--only", args.only.as_ref().map(Option::as_ref))];
    if turned.is_some() && (args.only.is_some() || args.without.is_some()) {
        let problem = "takes no labels together with --only or --without; use --turntable without a value";
        return Err(Error::usage("--turntable", problem));
    }
    if let Some((flag, picks)) = alone.into_iter().find_map(|(flag, picks)| Some((flag, picks?))) {
        return Ok(Some(Choice { flag, picks, alone: true }));
    }
    match &args.without {
        Some(picks) => Ok(Some(Choice { flag: "--without", picks: picks.as_ref(), alone: false })),
        None if args.prompts.is_empty() => Ok(None),
        None => {
            let problem = "or --without is needed, to say what to do with the labels of --name, --at, --box and --mask";
            Err(Error::usage("--only", problem))
        }
    }
}

fn asked<'a>(args: &'a RenderArgs, model: ModelRef<'a>, known: &'a Catalogue) -> LabelQuery<'a> {
    let (max_resolution, read) = (args.reading.max_resolution, args.reading.read.clone());
    let reading = SceneArgs { max_resolution, read, ..SceneArgs::default() };
    let (scene, memory) = (args.scene.as_deref(), args.memory.options());
    LabelQuery { path: &args.model, model, known, scene, reading, memory }
}

/// Returns the views to draw. The views of a turntable follow later, from the model.
fn shots(args: &RenderArgs) -> Result<Shots> {
    if args.motion.turntable.is_some() {
        return Ok(Shots { per_second: Some(args.motion.fps.into()), ..Shots::default() });
    }
    if let Some((per_second, cameras)) = args.motion.path_frames()? {
        return Ok(Shots { cameras: numbered(args, cameras), per_second: Some(per_second), ..Shots::default() });
    }
    if let Some(path) = &args.camera {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        return Ok(Shots { cameras: vec![(stem, read_camera(path)?)], ..Shots::default() });
    }
    let needed = || Error::usage("--scene", "--scene, --camera, --path or --turntable is needed");
    let scene = args.scene.as_ref().ok_or_else(needed)?;
    let dataset = open_scene(scene, &args.reading.of_run(&args.model)?, None, args.background, false)?;
    let views = pick_views(&dataset, &args.views)?;
    let cameras = stems(&views).into_iter().zip(&views).map(|(stem, view)| (stem, view.camera.clone())).collect();
    Ok(Shots { cameras, dataset: Some(dataset), per_second: None })
}
