//! `labelgs extract` and `labelgs remove`.

use super::args::{SceneArgs, SelectArgs};
use super::scene::{NEAR, find_view, open_gpu, open_scene, render_engine};
use super::{Context, open_model, stdout};
use crate::infer::choose::require_labels;
use crate::infer::render::render;
use crate::infer::select::{extract, remove};
use crate::io::ply::write_gaussians;
use crate::scene::Gaussians;
use crate::{Error, Result};
use serde_json::json;

/// Which part of the model is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The selected labels.
    Selected,
    /// Everything else.
    Rest,
}

/// Writes a part of a model.
pub fn run(args: &SelectArgs, keep: Keep, context: &Context) -> Result<()> {
    let model = open_model(&args.model)?;
    let labels = match &args.labels {
        Some(labels) => labels.0.clone(),
        None => labels_under_mask(args, &model, context)?,
    };
    let part = match keep {
        Keep::Selected => extract(&model, &labels)?,
        Keep::Rest => remove(&model, &labels)?,
    };
    let left_out = write_gaussians(&args.output, &part)?;
    let written = part.len() as u64 - left_out;
    if context.json || args.json.json {
        return stdout::print_json(&json!({
            "schema_version": 1,
            "output": args.output.display().to_string(),
            "labels": labels,
            "gaussians": written,
            "of": model.len(),
        }));
    }
    stdout::print(&format!("{}: {written} of {} Gaussians\n", args.output.display(), model.len()))
}

/// The labels that `--mask` in `--view` of `--scene` selects, by the label map of that view (method of the paper).
fn labels_under_mask(args: &SelectArgs, model: &Gaussians, context: &Context) -> Result<Vec<u32>> {
    let (Some(mask), Some(name), Some(scene)) = (&args.mask, &args.view, &args.scene) else {
        return Err(Error::usage("--mask", "needs --view and --scene"));
    };
    let Some(labels) = &model.labels else {
        return Err(Error::data(&args.model, "", "the model has no labels; train it with --masks"));
    };
    let mask_map = crate::io::mask::read_mask(mask)?;
    let reading = SceneArgs { test_every: 8, max_resolution: Some(mask_map.width.max(mask_map.height)) };
    let dataset = open_scene(scene, &reading, None, [0.0; 3], false)?;
    let camera = find_view(&dataset, name)?.camera.resized(mask_map.width, mask_map.height);
    let gpu = open_gpu(context)?;
    let mut engine = render_engine(gpu, model, std::iter::once((camera.width, camera.height)))?;
    engine.upload_model(model)?;
    let rendered = render(&mut engine, &camera, NEAR, [0.0; 3], model.sh_degree)?;
    let inside: Vec<bool> = mask_map.ids.iter().map(|&id| id != 0).collect();
    require_labels("--mask", &rendered.label_map(labels), &inside)
}
