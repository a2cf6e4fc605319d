//! `labelgs relabel`.

use super::Context;
use super::args::JsonFlag;
use super::labelled::{Edited, TableArg, open, wants_json};
use super::values::{Renumbering, renumbering};
use crate::Result;
use crate::infer::edit::relabel;
use crate::infer::rename::renumber;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs relabel`.
#[derive(Args, Clone, Debug)]
pub struct RelabelArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Old and new ids, all changed at once, such as 3=7,4=0; 0 is no label, and a new id that is in use is joined.
    #[arg(long, value_name = "OLD=NEW,..", value_parser = renumbering)]
    pub map: Renumbering,
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

/// Writes the model with the new ids.
pub fn run(args: &RelabelArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.table)?;
    let map = &args.map.0;
    known.check("--map", &map.keys().copied().collect())?;
    let edited = Edited {
        output: &args.output,
        model: &relabel(&model, map),
        table: known.table.as_ref().map(|table| renumber(table, map)),
        of: model.len(),
        labels: &map.values().copied().collect(),
    };
    edited.finish(wants_json(context, &args.json), json!({ "map": map }))
}
