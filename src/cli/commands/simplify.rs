//! `labelgs simplify`.

use crate::cli::support::parsers::{loss, near};
use crate::cli::support::{
    Context, EditArgs, EditResult, Progress, SceneArgs, near_plane, open_gpu, open_scene, stdout,
};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::edit::simplify::Simplifier;
use crate::engine::{Engine, EngineSize};
use crate::eval::evaluate::{Rendering, evaluate};
use crate::eval::subject::WholeModel;
use crate::render::RenderOptions;
use crate::scene::{Gaussians, View};
use crate::scheduler::SchedulerOptions;
use crate::train::strategy::weights::weights;
use crate::{Error, Result};
use clap::Args;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Shares of the Gaussians that the table has, in percent.
const TABLE_PERCENTAGES: [usize; 7] = [100, 75, 50, 35, 25, 15, 10];
/// Halvings of an interval between two shares: below a percent of the Gaussians.
const HALVINGS_MAX: u32 = 5;

/// `labelgs simplify`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("goal").required(true).args(["gaussians", "psnr_loss"])))]
pub struct SimplifyArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Scene of the model. Its training views measure what each Gaussian contributes, and its held-out views score the
    /// result.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of id masks, to score labels as well.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Reduce to this number of Gaussians.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub gaussians: Option<u64>,
    /// Reduce as far as this loss of PSNR allows, dB.
    #[arg(long, value_name = "DB", value_parser = loss)]
    pub psnr_loss: Option<f64>,
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Scores of a model with fewer Gaussians.
#[derive(Clone, Copy, Debug, Serialize)]
struct Row {
    gaussians: usize,
    psnr: f64,
    ssim: f64,
    iou_map: Option<f64>,
    iou_object: Option<f64>,
}

/// Scores models.
struct Scorer<'a> {
    engine: Engine,
    views: Vec<&'a View>,
    options: RenderOptions,
}

/// Writes the model with fewer Gaussians, and prints what that costs.
pub(crate) fn run(args: &SimplifyArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let near = near_plane(&args.edit.model, args.near)?;
    let dataset = open_scene(&args.scene, &args.reading, args.masks.clone(), [0.0; 3], true)?;
    if model.is_empty() || dataset.train.is_empty() {
        let (what, problem) = match model.is_empty() {
            true => (&args.edit.model, "has no Gaussians"),
            false => (&args.scene, "no training view is left; use a larger --test-every"),
        };
        return Err(Error::data(what, "", problem));
    }
    let gpu = open_gpu(context)?;
    let sizes = dataset.all().into_iter().map(|view| (view.camera.width, view.camera.height));
    let size = EngineSize::for_model(&model, sizes).for_training();
    let mut engine = Engine::new(gpu, size, SchedulerOptions::default())?;
    engine.upload_model(&model)?;
    let weights = weights(&mut engine, dataset.train.iter().map(|view| (&view.camera, near)))?;
    let views = if dataset.test.is_empty() { &dataset.train } else { &dataset.test };
    let options = RenderOptions { near, ..RenderOptions::default() };
    let mut scorer = Scorer { engine, views: views.iter().collect(), options };

    let mut simplifier = Simplifier::new(&model, &weights);
    let (mut rows, mut enough) = (Vec::new(), None);
    let mut progress = Progress::new(TABLE_PERCENTAGES.len() as u64, "sizes", &context.global);
    for (done, share) in (1..).zip(TABLE_PERCENTAGES) {
        simplifier.reduce_to((model.len() * share).div_ceil(100))?;
        let row = scorer.score(&simplifier.model())?;
        rows.push(row);
        if row.suffices(args, &rows[0]) {
            enough = Some((simplifier.clone(), row));
        }
        progress.set(done, String::new);
    }
    drop(progress);
    // The first size, of all Gaussians, always does.
    let enough = enough.ok_or_else(|| Error::Bug("no size of the table does".to_owned()))?;
    let (simplifier, chosen) = match args.gaussians {
        Some(count) => exactly(count, enough, &mut scorer)?,
        None => fewest(args, &rows, enough, &mut scorer)?,
    };
    if !context.json {
        stdout::print(&table(&rows, &chosen))?;
    }
    let small = simplifier.model();
    let edited = EditResult::with_labels_of(&small, known, model.len());
    args.edit.finish(context, &edited, json!({ "table": rows, "chosen": chosen }))
}

/// Merges until `count` are left.
fn exactly<'a>(
    count: u64,
    (mut simplifier, row): (Simplifier<'a>, Row),
    scorer: &mut Scorer,
) -> Result<(Simplifier<'a>, Row)> {
    let before = simplifier.count();
    if count > before as u64 {
        tracing::warn!("the model has only {before} Gaussians, not more than {count}: nothing changes");
    }
    simplifier.reduce_to(usize::try_from(count).unwrap_or(usize::MAX))?;
    let row = if simplifier.count() == before { row } else { scorer.score(&simplifier.model())? };
    Ok((simplifier, row))
}

/// Halves the interval between the sizes of the table of which one loses too much. Returns the smallest model found
/// that does not.
fn fewest<'a>(
    args: &SimplifyArgs,
    rows: &[Row],
    (mut enough, mut chosen): (Simplifier<'a>, Row),
    scorer: &mut Scorer,
) -> Result<(Simplifier<'a>, Row)> {
    let mut below = rows.iter().map(|row| row.gaussians).find(|&count| count < enough.count()).unwrap_or(1);
    for _ in 0..HALVINGS_MAX {
        let middle = below.midpoint(enough.count());
        let mut next = enough.clone();
        next.reduce_to(middle)?;
        if next.count() == enough.count() || middle == below {
            break;
        }
        let row = scorer.score(&next.model())?;
        if row.suffices(args, &rows[0]) {
            (enough, chosen) = (next, row);
        } else {
            below = middle;
        }
    }
    Ok((enough, chosen))
}

impl Row {
    /// Returns true if more may be merged.
    fn suffices(&self, args: &SimplifyArgs, all: &Self) -> bool {
        match args.gaussians {
            Some(count) => self.gaussians as u64 >= count,
            None => self.psnr >= all.psnr - args.psnr_loss.unwrap_or_default(),
        }
    }
}

impl Scorer<'_> {
    fn score(&mut self, model: &Gaussians) -> Result<Row> {
        let mut whole = WholeModel { engine: &mut self.engine, model, min_confidence: MIN_LABEL_CONFIDENCE };
        let mean = evaluate(&mut whole, &self.views, Rendering::new(self.options), &(), &mut ())?.mean;
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        Ok(Row {
            gaussians: model.len(),
            psnr: number(mean.psnr),
            ssim: number(mean.ssim),
            iou_map: mean.objects.iou_map,
            iou_object: mean.objects.iou_object,
        })
    }
}

fn table(rows: &[Row], chosen: &Row) -> String {
    let iou = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:>9.3}"));
    let has_labels = rows.iter().any(|row| row.iou_map.is_some());
    let mut text = format!("{:>10} {:>8} {:>8} {:>8}", "Gaussians", "PSNR", "loss, dB", "SSIM");
    text += if has_labels { "  iou_map iou_object\n" } else { "\n" };
    let all = rows[0].psnr;
    let mut rows: Vec<(&Row, &str)> = rows.iter().map(|row| (row, "")).collect();
    rows.retain(|(row, _)| row.gaussians != chosen.gaussians);
    rows.push((chosen, "  <- written"));
    rows.sort_by_key(|(row, _)| std::cmp::Reverse(row.gaussians));
    for (row, mark) in rows {
        let Row { gaussians, psnr, ssim, iou_map, iou_object } = *row;
        text += &format!("{gaussians:>10} {psnr:>8.2} {:>8.2} {ssim:>8.4}", all - psnr);
        text += &format!("{}{}{mark}\n", iou(iou_map), iou(iou_object));
    }
    text
}
