//! `labelgs split-components`.

use super::Context;
use super::args::JsonFlag;
use super::labelled::{Edited, TableArg, open, wants_json};
use super::select::GroupingArgs;
use super::values::{Picks, picks};
use crate::Result;
use crate::infer::edit::{Specks, split_components};
use crate::infer::rename::split;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs split-components`.
#[derive(Args, Clone, Debug)]
pub struct SplitArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// The labels to split, each for itself, by id or by name. The largest part keeps the id, others get free ones.
    #[arg(long, value_name = "LABELS", value_parser = picks)]
    pub labels: Picks,
    /// What becomes of parts below --min-share.
    #[arg(long, value_name = "WHAT", value_enum, default_value = "keep")]
    pub specks: Specks,
    /// What is connected.
    #[command(flatten)]
    pub grouping: GroupingArgs,
    /// File to write; names of its labels go to OUT.labels.json beside it.
    #[arg(short, long, value_name = "OUT.ply")]
    pub output: PathBuf,
    /// Names.
    #[command(flatten)]
    pub table: TableArg,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Writes the model with a label for each part.
pub fn run(args: &SplitArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.table)?;
    let labels = known.resolve("--labels", &args.labels.0)?;
    let named = known.table.iter().flat_map(|table| &table.labels).map(|entry| entry.id).collect();
    let found = split_components(&model, &labels, &named, args.grouping.grouping(), args.specks)?;
    for (&label, ids) in &found.ids {
        tracing::info!("{}: {} parts: {ids:?}", known.title(label), ids.len());
    }
    let edited = Edited {
        output: &args.output,
        model: &found.model,
        table: known.table.as_ref().map(|table| split(table, &found.ids)),
        of: model.len(),
        labels: &found.ids.values().flatten().copied().collect(),
    };
    edited.finish(wants_json(context, &args.json), json!({ "parts": found.ids, "specks": found.specks }))
}
