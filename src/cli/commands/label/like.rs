//! `labelgs label --like`: labels of a model for a copy that another program has changed.

use super::LabelArgs;
use crate::Result;
use crate::cli::support::model_edit::open;
use crate::cli::support::{Context, TableArg, open_model, require_labels};
use crate::edit::carry::{CarriedLabels, carry};
use crate::edit::rename::keep;
use crate::edit::select::summarise;
use crate::formats::export_model;
use crate::words::counted;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::Path;

/// Gives the copy its labels.
pub(super) fn run(args: &LabelArgs, labelled: &Path, context: &Context) -> Result<()> {
    let (source, known) = open(labelled, &TableArg::default())?;
    require_labels(labelled, source.labels.is_some())?;
    let CarriedLabels { model, same, near, none } = carry(&open_model(&args.model)?, &source)?;
    let rows = summarise(&model);
    let there: BTreeSet<u32> = rows.iter().map(|row| row.label).collect();
    let table = known.table.as_ref().map(|table| keep(table, |id| there.contains(&id)));
    export_model(&args.output, &model, table.as_ref(), args.write.options(labelled, &args.output)?)?;
    let output = args.output.display().to_string();
    let text = format!(
        "{output}: {}: {same} match {} exactly, {near} match a nearby one, {none} match nothing and get no label\n",
        counted(model.len(), "Gaussian"),
        labelled.display(),
    );
    let result = json!({
        "schema_version": 1, "output": output, "gaussians": model.len(), "same": same, "near": near, "none": none,
        "labels": rows,
    });
    context.show(&result, &text)
}
