//! `labelgs split-components`.

use crate::Result;
use crate::cli::commands::extract_remove::GroupingArgs;
use crate::cli::support::parsers::{Picks, picks};
use crate::cli::support::{Context, EditArgs, EditResult};
use crate::edit::change::{SmallParts, split_components};
use crate::edit::rename::split;
use crate::words::counted;
use clap::Args;
use serde_json::json;

/// `labelgs split-components`.
#[derive(Args, Clone, Debug)]
pub struct SplitArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Labels to split, by id or name. The largest part of a label keeps its id; the other parts get free ids.
    #[arg(long, value_name = "LABELS", value_parser = picks)]
    pub labels: Picks,
    /// What to do with fragments smaller than --min-share.
    #[arg(long, alias = "fragments", value_name = "WHAT", value_enum, default_value = "keep")]
    pub specks: SmallParts,
    /// Definition of connected parts.
    #[command(flatten)]
    pub grouping: GroupingArgs,
}

/// Writes the model with a label for each part.
pub(crate) fn run(args: &SplitArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let labels = args.edit.resolve(&known, "--labels", &args.labels)?;
    let named = known.table.iter().flat_map(|table| &table.labels).map(|entry| entry.id).collect();
    let found = split_components(&model, &labels, &named, args.grouping.grouping(), args.specks)?;
    for (&label, ids) in &found.ids {
        tracing::info!("{}: {}: {ids:?}", known.title(label), counted(ids.len(), "part"));
    }
    let table = known.table.as_ref().map(|table| split(table, &found.ids));
    let edited = EditResult::new(&found.model, table, model.len(), found.ids.values().flatten().copied().collect());
    args.edit.finish(context, &edited, json!({ "parts": found.ids, "specks": found.specks }))
}
