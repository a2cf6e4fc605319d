//! `labelgs label`.

mod click;
mod like;
mod strokes;

use crate::cli::commands::masks::repair::table;
use crate::cli::support::nested_masks::{MaskFolders, choose_objects};
use crate::cli::support::parsers::{model_file, near};
use crate::cli::support::{
    Context, Progress, SceneArgs, WriteArgs, near_plane, open_gpu, open_model, open_scene, warn_of_misfit,
};
use crate::edit::select::summarise;
use crate::files::label_table::LabelTable;
use crate::formats::export_model;
use crate::gpu::Gpu;
use crate::label::masks::agree::{Agreement, Ids, OBJECT_VIEWS_MIN, agree};
use crate::label::vote::model::{VOTE_ROUNDS, VoteOptions, columns_of, label_by_lift, label_by_votes, vote_engine};
use crate::scene::{Gaussians, View};
use crate::stage::Stage;
use crate::train::LabelRule;
use crate::words::counted;
use crate::{Error, Result};
use clap::{ArgGroup, Args};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// `labelgs label`.
#[derive(Args, Clone, Debug)]
#[command(group = ArgGroup::new("views").multiple(true)
    .args(["scene", "masks", "per_view", "rule", "mask_border", "min_confidence", "near"])
    .args(["test_every", "max_resolution", "ignore", "poses"]))]
pub struct LabelArgs {
    /// Model of any trainer: a PLY file, or the output folder of `labelgs train`. Masks replace existing labels.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene with the cameras of the masks.
    #[arg(long, value_name = "SCENE", required_unless_present = "like")]
    pub scene: Option<PathBuf>,
    /// Folder of id masks, named as the views. From the folder of `masks make`, or from Segment Anything's mask lists,
    /// the objects are chosen among the nested masks by agreement of all views.
    #[arg(long, value_name = "DIR", required_unless_present_any = ["places", "like", "strokes"])]
    pub masks: Option<PathBuf>,
    /// Match the ids between views first, as `masks repair` does. Use it for masks of a single-image segmenter, whose
    /// ids differ in each view.
    #[arg(long)]
    pub per_view: bool,
    /// File to write.
    #[arg(short, long, value_name = "OUT.ply", value_parser = model_file())]
    pub output: PathBuf,
    #[command(flatten)]
    pub write: WriteArgs,
    #[command(flatten)]
    pub clicks: click::ClickArgs,
    /// Copy labels from this labelled model, if MODEL is a copy of it that another program sorted, rounded, thinned or
    /// merged. Each Gaussian gets the label at its position, else the label of the nearest Gaussian. Needs no device.
    #[arg(long, value_name = "LABELLED", conflicts_with_all = ["views", "ClickArgs", "FileArgs", "strokes"])]
    pub like: Option<PathBuf>,
    /// Label objects from strokes over photos, on objects and on background, listed in this file. Labels and names
    /// come from the file; other labels are kept.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["masks", "places"], help_heading = "Strokes")]
    pub strokes: Option<PathBuf>,
    /// How to label a Gaussian: by votes of all views, or as in the paper, by the last view in which it dominates a
    /// pixel.
    #[arg(long, value_name = "RULE", value_enum, default_value = "votes", help_heading = "Labels")]
    pub rule: LabelRule,
    /// Ignore pixels this close to a mask contour, px. Use 2 for tracker masks.
    #[arg(long, value_name = "PX", default_value_t = 0, help_heading = "Labels")]
    pub mask_border: u32,
    /// Minimum share of votes for a label; Gaussians below it get no label.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, help_heading = "Labels")]
    pub min_confidence: f32,
    /// Near plane, world units; closer Gaussians are ignored. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// How the scene is read. Test views have no votes.
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Gives the Gaussians of a trained model their labels.
pub(crate) fn run(args: &LabelArgs, context: &Context) -> Result<()> {
    if let Some(labelled) = &args.like {
        return like::run(args, labelled, context);
    }
    let scene =
        args.scene.as_ref().ok_or_else(|| Error::usage("--scene", "is missing; masks, clicks and strokes need it"))?;
    if let Some(file) = &args.strokes {
        return strokes::run(args, (scene, file), context);
    }
    let Some(folder) = &args.masks else {
        return click::run(args, scene, context);
    };
    let (mut model, near) = (open_model(&args.model)?, near_plane(&args.model, args.near)?);
    let masks = MaskFolders::from_folder(folder)?;
    let mut dataset = open_scene(scene, &args.reading, masks.pictures.clone(), [0.0; 3], true)?;
    dataset.train.retain(|view| view.mask.is_some() || masks.lists.is_some());
    if dataset.train.is_empty() {
        return Err(Error::data(
            folder,
            "",
            "no training view has a mask in this folder; check the names of the masks and --test-every",
        ));
    }
    warn_of_misfit(&args.model, &model, &dataset)?;
    let gpu = open_gpu(context)?;
    let start = Instant::now();
    if let Some(lists) = &masks.lists {
        choose_objects(lists, (scene, &args.reading), &gpu, (&model, near, None), &mut dataset.train)?;
        dataset.train.retain(|view| view.mask.is_some());
    }
    let names = match masks.ids(args.per_view) {
        Ids::Shared => LabelTable::read_in_folder(folder)?,
        ids => Some(make_agree(folder, near, &gpu, &model, (&mut dataset.train, ids))?),
    };
    let views: Vec<&View> = dataset.train.iter().collect();
    let mut engine = vote_engine(gpu, &model, &views, columns_of(&views))?;
    let mut progress = Progress::new(u64::from(VOTE_ROUNDS), "rounds", &context.global);
    if args.rule == LabelRule::Main {
        label_by_lift(&mut engine, &mut model, &views, near)?;
    } else {
        let how = VoteOptions { near, mask_border: args.mask_border, min_confidence: args.min_confidence };
        label_by_votes(&mut engine, &mut model, &views, &how, &mut |round| {
            progress.set(u64::from(round), String::new)
        })?;
    }
    drop(progress);
    let seconds = start.elapsed().as_secs_f64();
    finish(args, (&model, names.as_ref()), (views.len(), seconds), context)
}

/// Writes the labelled model, and prints its labels.
fn finish(
    args: &LabelArgs,
    (model, names): (&Gaussians, Option<&LabelTable>),
    (views, seconds): (usize, f64),
    context: &Context,
) -> Result<()> {
    let options = args.write.options(&args.model, &args.output)?;
    export_model(&args.output, model, names, options)?;
    let rows = summarise(model);
    let (output, gaussians) = (args.output.display().to_string(), model.len());
    let objects = || rows.iter().filter(|row| row.label != 0);
    let text = format!(
        "{output}: {} of {} belong to {}, from {} in {seconds:.1} s\n",
        objects().map(|row| row.count).sum::<u64>(),
        counted(gaussians, "Gaussian"),
        counted(objects().count(), "object"),
        counted(views, "view")
    );
    let result = json!({
        "schema_version": 1, "output": output, "views": views, "seconds": seconds, "gaussians": gaussians, "labels": rows,
    });
    context.show(&result, &text)
}

/// Replaces the masks of the views by those whose ids agree, and returns their names.
fn make_agree(
    folder: &Path,
    near: f32,
    gpu: &Arc<Gpu>,
    model: &Gaussians,
    (views, ids): (&mut [View], Ids),
) -> Result<LabelTable> {
    let borrowed: Vec<&View> = views.iter().collect();
    let mut engine = vote_engine(Arc::clone(gpu), model, &borrowed, columns_of(&borrowed))?;
    let how = Agreement { near, ids, min_views: OBJECT_VIEWS_MIN, make_missing: false };
    let stage = Stage::new("comparing masks", 2 * borrowed.len());
    let (masks, _) = agree(&mut engine, model, &borrowed, how, &mut || stage.count())?;
    let names = table(folder, true, &borrowed, &masks)?;
    views.iter_mut().zip(masks).for_each(|(view, mask)| view.mask = mask.map(Into::into));
    Ok(names)
}
