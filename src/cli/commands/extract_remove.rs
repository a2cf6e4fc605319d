//! `labelgs extract` and `labelgs remove`.

use crate::cli::commands::occlusion::from_model;
use crate::cli::support::model_edit::look;
use crate::cli::support::parsers::{distance, share};
use crate::cli::support::{
    ChooseArgs, Context, EditArgs, EditResult, LabelledModel, MinConfidenceArg, Progress, SceneArgs, near_plane,
    open_gpu, open_model, open_scene, warn_of_misfit,
};
use crate::edit::change::without_specks;
use crate::edit::components::Grouping;
use crate::edit::fill::{Filled, Light, Sight, fill};
use crate::edit::rename::keep;
use crate::edit::select::remove;
use crate::engine::Engine;
use crate::eval::removal::sights;
use crate::scene::{Gaussians, View};
use crate::scheduler::SchedulerOptions;
use crate::train::{REFIT_STEPS, refitted};
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `labelgs remove`.
#[derive(Args, Clone, Debug)]
pub struct RemoveArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    #[command(flatten)]
    pub choice: ChooseArgs,
    /// Fill the holes that the objects leave, by extending the surrounding surfaces. Needs --scene, to find the areas
    /// that no training view saw.
    ///
    /// If the scene has one strong light that casts shadows of labelled objects, the shadows of the removed objects are
    /// removed from the surrounding planes too.
    #[arg(long, requires = "scene")]
    pub fill: bool,
    /// With --fill, keep the shadows of the removed objects.
    #[arg(long, requires = "fill")]
    pub keep_shadow: bool,
}

/// `labelgs extract`.
#[derive(Args, Clone, Debug)]
pub struct ExtractArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    #[command(flatten)]
    pub choice: ChooseArgs,
    /// Minimum confidence of the extracted Gaussians.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Refit the opacities of the extracted objects to the photos of --scene and to --masks. This removes haze around
    /// them.
    #[arg(long, requires = "scene", requires = "masks")]
    pub refit: bool,
    /// With --refit, the folder of id masks that the labels were made from.
    #[arg(long, value_name = "DIR", requires = "refit")]
    pub masks: Option<PathBuf>,
    /// Drop fragments: connected parts of an object smaller than --min-share.
    #[arg(long, alias = "drop-fragments")]
    pub drop_specks: bool,
    /// Definition of fragments.
    #[command(flatten)]
    pub grouping: GroupingArgs,
}

/// Definition of connected parts and specks.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Connected parts")]
pub struct GroupingArgs {
    /// Smallest fragment to keep, as a share of the object's Gaussians (the largest fragment is always kept).
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05)]
    pub min_share: f32,
    /// Maximum gap between the ellipsoids (two standard deviations) of connected Gaussians, world units.
    #[arg(long, value_name = "DISTANCE", value_parser = distance, default_value_t = 0.0)]
    pub gap: f64,
}

impl GroupingArgs {
    /// Returns the rule for connected parts.
    pub fn grouping(&self) -> Grouping {
        Grouping { gap: self.gap, min_share: f64::from(self.min_share) }
    }
}

/// Writes the Gaussians of the chosen labels.
pub(crate) fn run_extract(args: &ExtractArgs, context: &Context) -> Result<()> {
    let ExtractArgs { edit, choice, .. } = args;
    let LabelledModel { model, known, .. } = look(&edit.model, &edit.table)?;
    let labels = choice.labels(&edit.model, model.view(), &known, context)?;
    let whole = args.sure.extract_seen(&edit.model, model.view(), &labels)?;
    let part = if args.drop_specks { without_specks(&whole, args.grouping.grouping())? } else { whole.clone() };
    let part = match (choice.scene.as_deref(), &args.masks) {
        (Some(scene), Some(masks)) => alone(args, (scene, masks), &part, context)?,
        _ => part,
    };
    let table = known.table.as_ref().map(|table| keep(table, |id| labels.contains(&id)));
    let of = known.gaussians.values().sum::<u64>() as usize;
    let specks = whole.len() - part.len();
    let chosen: u64 = labels.iter().filter_map(|label| known.gaussians.get(label)).sum();
    let unsure = chosen - (whole.len() as u64).min(chosen);
    let least = args.sure.min_confidence;
    let note = match unsure {
        0 => String::new(),
        _ => format!("; {unsure} more have a confidence below {least} (see --min-confidence)"),
    };
    let edited = EditResult { note, alone: true, ..EditResult::new(&part, table, of, labels) };
    edit.finish(context, &edited, json!({ "specks": specks, "unsure": unsure }))
}

/// Fits the opacities of objects that stand alone.
fn alone(args: &ExtractArgs, (scene, masks): (&Path, &Path), objects: &Gaussians, to: &Context) -> Result<Gaussians> {
    let (path, choice) = (&args.edit.model, &args.choice);
    let (model, near) = (open_model(path)?, near_plane(path, choice.prompts.near)?);
    let dataset = open_scene(scene, &choice.reading(path)?, Some(masks.to_owned()), [0.0; 3], true)?;
    warn_of_misfit(path, &model, &dataset)?;
    let views: Vec<&View> = dataset.train.iter().filter(|view| view.mask.is_some()).collect();
    let gpu = open_gpu(to)?;
    let occluders = from_model(Arc::clone(&gpu), (&model, near), &views, to)?;
    drop(model);
    let mut progress = Progress::new(u64::from(REFIT_STEPS), "steps", &to.global);
    let mut watch = |step| progress.set(u64::from(step), String::new);
    refitted(&gpu, objects, (&views, &occluders), near, SchedulerOptions::default(), &mut watch)
}

/// Writes the Gaussians of all other labels.
pub(crate) fn run_remove(args: &RemoveArgs, context: &Context) -> Result<()> {
    let RemoveArgs { edit, choice, .. } = args;
    let (model, known) = edit.open()?;
    let labels = choice.labels(&edit.model, &model, &known, context)?;
    let listed: Vec<u32> = labels.iter().copied().collect();
    let (part, added, more) = match choice.scene.as_deref().filter(|_| args.fill) {
        None => (remove(&model, &listed)?, 0, json!({})),
        Some(scene) => {
            let Filled { model, added, hidden, lit } = filled(args, scene, &model, &listed, context)?;
            let count: u64 = added.values().sum();
            tracing::info!(
                "filled the hole with {}; removed {} that no view shows; removed a shadow from {lit}",
                counted(count, "Gaussian"),
                counted(hidden, "Gaussian")
            );
            (model, count, json!({ "added": added, "hidden": hidden, "lit": lit }))
        }
    };
    let table = known.table.as_ref().map(|table| keep(table, |id| !labels.contains(&id)));
    edit.finish(context, &EditResult { added, ..EditResult::new(&part, table, model.len(), labels) }, more)
}

/// Removes labels and closes their place by what the training views of a scene show.
fn filled(args: &RemoveArgs, scene: &Path, model: &Gaussians, labels: &[u32], context: &Context) -> Result<Filled> {
    let RemoveArgs { edit, choice, keep_shadow, .. } = args;
    // A choice of nothing or of everything is refused before any image.
    remove(model, labels)?;
    let near = near_plane(&edit.model, choice.prompts.near)?;
    let sights = scene_sights((scene, &choice.reading(&edit.model)?), (model, near), context)?;
    let light = if *keep_shadow { None } else { Light::of(model, &sights)? };
    if let Some(Light { towards, shade }) = light {
        let share = shade.element_sum() / 3.0;
        tracing::info!("light direction {towards:.2}; shadows are {share:.2} times as bright as their surroundings");
    }
    fill(model, labels, &sights, light.as_ref())
}

/// Draws a model from the training views of a scene, for what fills a hole.
pub(super) fn scene_sights(
    (scene, reading): (&Path, &SceneArgs),
    (model, near): (&Gaussians, f32),
    context: &Context,
) -> Result<Vec<Sight>> {
    let dataset = open_scene(scene, reading, None, [0.0; 3], false)?;
    let views: Vec<&View> = dataset.train.iter().collect();
    if views.is_empty() {
        return Err(Error::data(scene, "", "has no training view; filling a hole needs views of its surroundings"));
    }
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    let mut engine = Engine::for_model(open_gpu(context)?, model, sizes)?;
    sights(&mut engine, &views, near)
}
