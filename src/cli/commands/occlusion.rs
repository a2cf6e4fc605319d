//! `labelgs occlusion`.

use crate::cli::support::parsers::json_file;
use crate::cli::support::{Context, Progress, ReadArgs, near_plane, open_gpu, open_model};
use crate::engine::Engine;
use crate::files::image::write_png_rgb8;
use crate::gpu::Gpu;
use crate::label::occlusion::{Rule, from_depths, occluders_by_contour, picture};
use crate::records::occlusion_table::OcclusionTable;
use crate::render::{Parts, RenderOptions, render};
use crate::scene::{DepthKind, Gaussians, LabelMap, Occluders, View, stems};
use crate::scenes::{self, LoadOptions};
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `labelgs occlusion`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("from").required(true).args(["depths", "model"])))]
pub struct OcclusionArgs {
    /// Scene: a folder (COLMAP, transforms.json, poses_bounds.npy, Metashape) or a .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of id masks.
    #[arg(long, value_name = "DIR")]
    pub masks: PathBuf,
    /// Folder of depth maps, named as the photos: 16-bit PNG, EXR, NPY or PFM. Applies the rule of the LabelGS paper.
    #[arg(long, value_name = "DIR", requires = "depth_kind")]
    pub depths: Option<PathBuf>,
    /// Meaning of the values in --depths.
    #[arg(long, value_name = "KIND", value_enum, requires = "depths")]
    pub depth_kind: Option<DepthKind>,
    /// Use the rendered depth of this model: a PLY file, or the output folder of `labelgs train`.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// File to write.
    #[arg(short, long, value_name = "FILE.json", value_parser = json_file())]
    pub output: PathBuf,
    /// Write an image of each view, NAME.png, to this folder: contours are white in front, black behind, grey if
    /// undecided.
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Longest side of an image, px. Default: the photo size.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Scene")]
    pub max_resolution: Option<u32>,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// Finds the occluders of all views with masks.
pub(crate) fn run(args: &OcclusionArgs, context: &Context) -> Result<()> {
    let options = LoadOptions {
        masks: Some(args.masks.clone()),
        max_resolution: args.max_resolution,
        photos: false,
        ..LoadOptions::default()
    };
    let dataset = scenes::open_logged(&args.scene, &args.read.options(options))?;
    let views: Vec<&View> = dataset.all().into_iter().filter(|view| view.mask.is_some()).collect();
    let table = match (&args.depths, args.depth_kind, &args.model) {
        (Some(depths), Some(kind), _) => {
            let scene = (args.scene.as_path(), &args.read.lookup());
            OcclusionTable::new("depth", from_depths(scene, depths, kind, &views)?)
        }
        (_, _, Some(path)) => {
            let (model, near) = (open_model(path)?, near_plane(path, None)?);
            OcclusionTable::new("rendered", from_model(open_gpu(context)?, (&model, near), &views, context)?)
        }
        _ => return Err(Error::usage("--depths", "needs --depth-kind, or use --model instead")),
    };
    if let Some(folder) = &args.pictures {
        views.iter().zip(stems(&views)).try_for_each(|(view, stem)| draw(folder, (view, &stem), &table))?;
    }
    table.write(&args.output)?;
    let (pairs, views, output) = (table.pair_count(), table.views.len(), args.output.display().to_string());
    let [of, seen] = [counted(pairs, "pair"), counted(views, "view")];
    let text = format!("{output}: {of} of object and occluder in {seen}\n");
    let kind = table.kind;
    context.show(&json!({ "schema_version": 1, "output": output, "kind": kind, "views": views, "pairs": pairs }), &text)
}

/// Returns the occluders in views with masks, by the depth of a model.
pub(crate) fn from_model(
    gpu: Arc<Gpu>,
    (model, near): (&Gaussians, f32),
    views: &[&View],
    context: &Context,
) -> Result<BTreeMap<String, Occluders>> {
    let mut engine = Engine::for_model(gpu, model, views.iter().map(|view| (view.camera.width, view.camera.height)))?;
    let mut progress = Progress::new(views.len() as u64, "views", &context.global);
    let mut found = BTreeMap::new();
    for view in views {
        let rendered = render(&mut engine, &view.camera, &RenderOptions::new(near, Parts::DEPTH))?;
        found.insert(view.name.clone(), occluders_by_contour(&*mask(view)?, &rendered.mean_depth()?, Rule::default()));
        progress.set(found.len() as u64, String::new);
    }
    Ok(found)
}

fn draw(folder: &Path, (view, stem): (&View, &str), table: &OcclusionTable) -> Result<()> {
    let (mask, none) = (mask(view)?, Occluders::new());
    let pixels = picture(&mask, table.views.get(&view.name).unwrap_or(&none));
    write_png_rgb8(folder.join(format!("{stem}.png")), mask.width, mask.height, &pixels)
}

fn mask(view: &View) -> Result<Arc<LabelMap>> {
    view.mask()?.ok_or_else(|| Error::Bug(format!("{} came without its mask", view.name)))
}
