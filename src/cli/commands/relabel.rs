//! `labelgs relabel`.

use crate::Result;
use crate::cli::support::context::Context;
use crate::cli::support::model_edit::{EditArgs, Edited, open, or_list};
use crate::cli::support::parsers::{Renumbering, renumbering};
use crate::edit::change::relabel;
use crate::edit::rename::renumber;
use clap::Args;
use serde_json::json;

/// `labelgs relabel`.
#[derive(Args, Clone, Debug)]
pub struct RelabelArgs {
    /// Model and output.
    #[command(flatten)]
    pub edit: EditArgs,
    /// Old and new ids, all changed at once, such as 3=7,4=0. 0 means no label; a new id that is in use merges with its
    /// label.
    #[arg(long, value_name = "OLD=NEW,..", value_parser = renumbering)]
    pub map: Renumbering,
}

/// Writes the model with the new ids.
pub(crate) fn run(args: &RelabelArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.edit.model, &args.edit.table)?;
    let map = &args.map.0;
    or_list(known.check("--map", &map.keys().copied().collect()), &args.edit.model)?;
    let edited = Edited {
        model: &relabel(&model, map),
        table: known.table.as_ref().map(|table| renumber(table, map)),
        of: model.len(),
        added: 0,
        labels: &map.values().copied().collect(),
    };
    edited.finish(&args.edit.target(context), json!({ "map": map }))
}
