//! Labels for the model of a run that was trained without masks.

use super::info::{self, Info};
use super::models::{Models, open};
use super::pictures::Worst;
use super::{Inputs, Request, Settings, Summary, objects, prepare, report};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::error::{Error, Result};
use crate::eval::evaluate::{Rendering, evaluate};
use crate::eval::subject::Whole;
use crate::files::label_table::{self, LabelTable};
use crate::gpu::Gpu;
use crate::label::vote::model::{Counting, columns_of, label_by_lift, label_by_votes, limited_vote_engine};
use crate::render::RenderOptions;
use crate::scene::View;
use crate::scheduler::SchedulerOptions;
use crate::stage::Stage;
use crate::train::{LabelRule, TrainConfig};
use std::path::Path;
use std::sync::Arc;

/// Labels the model of a finished run by masks that agree, scores its objects, and writes what a run with these masks has in its
/// folder. The caller holds the lock of the folder.
pub(crate) fn label(request: &Request, masks: &Path, gpu: Arc<Gpu>, mut summary: Summary) -> Result<Summary> {
    let out = request.output.as_path();
    let settings = Settings::of_model(out)?.ok_or_else(|| Error::data(out, "", "has no settings of a run"))?;
    let inputs = Inputs { masks: Some(masks.to_owned()), ..request.inputs.clone() };
    let dataset = prepare::read_scene(request, &settings, &inputs, None)?;
    let (train, test): (Vec<&View>, Vec<&View>) = (dataset.train.iter().collect(), dataset.test.iter().collect());
    let mut model = open(&summary.model)?.gaussians;
    let memory = SchedulerOptions { memory_limit: inputs.memory_limit, ..SchedulerOptions::default() };
    let mut engine = limited_vote_engine(gpu, &model, &dataset.all(), columns_of(&train), memory)?;
    let TrainConfig { near, background, mask_border, label_rule, .. } = settings.train;
    match label_rule {
        LabelRule::Main => label_by_lift(&mut engine, &mut model, &train, near)?,
        LabelRule::Votes => {
            let how = Counting { near, mask_border, min_confidence: 0.0 };
            label_by_votes(&mut engine, &mut model, &train, &how, &mut |_| ())?;
        }
    }
    let names = LabelTable::of_folder(masks)?;
    Models::new(out, summary.steps)?.save(summary.steps, &model)?;
    LabelTable::put(names.as_ref(), &out.join(label_table::FILE))?;
    let mut info = Info::read(&out.join(info::FILE))?.unwrap_or_default();
    (info.masks, info.labelled_after) = (Some(masks.display().to_string()), true);
    if !test.is_empty() {
        let _stage = Stage::new("scoring the held-out views", 0);
        let how = Rendering::new(RenderOptions { near, background, ..RenderOptions::default() });
        let mut worst = Worst::default();
        let mut whole = Whole { engine: &mut engine, model: &model, min_confidence: MIN_LABEL_CONFIDENCE };
        summary.scores = Some(evaluate(&mut whole, &test, how, &(), &mut worst)?);
        info.pictures = worst.write(out)?;
    }
    summary.objects = objects::of(&model, names.as_ref(), summary.scores.as_ref());
    summary.write(out)?;
    info.write(out)?;
    report::write(&[out.to_owned()], &out.join(report::FILE))?;
    Ok(summary)
}

/// Returns the masks that a run in a folder was trained with, if it was trained with any.
pub(crate) fn trained_masks(out: &Path) -> Result<Option<String>> {
    let info = Info::read(&out.join(info::FILE))?;
    Ok(info.filter(|info| !info.labelled_after).and_then(|info| info.masks))
}
