//! `labelgs extract` and `labelgs remove`.

use super::args::SelectArgs;
use super::{Context, open_model, stdout};
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

/// The labels that `--mask` in `--view` of `--scene` selects; needs the label map of that view.
fn labels_under_mask(_args: &SelectArgs, _model: &Gaussians, _context: &Context) -> Result<Vec<u32>> {
    Err(Error::Bug("not built yet".into()))
}
