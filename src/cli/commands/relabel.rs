//! `labelgs relabel`.

use crate::Result;
use crate::cli::support::parsers::{Renumbering, renumbering};
use crate::cli::support::{Context, EditArgs, EditResult, or_list};
use crate::edit::change::relabel;
use crate::edit::rename::renumber;
use clap::Args;
use serde_json::json;

/// `labelgs relabel`.
#[derive(Args, Clone, Debug)]
pub struct RelabelArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Old and new ids, such as 3=7,4=0, changed all at once. 0 means no label. A new id that exists already is merged
    /// with that label.
    #[arg(long, value_name = "OLD=NEW,..", value_parser = renumbering)]
    pub map: Renumbering,
}

/// Writes the model with the new ids.
pub(crate) fn run(args: &RelabelArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let map = &args.map.0;
    or_list(known.check("--map", &map.keys().copied().collect()), &args.edit.model)?;
    let (changed, table) = (relabel(&model, map), known.table.as_ref().map(|table| renumber(table, map)));
    let edited = EditResult::new(&changed, table, model.len(), map.values().copied().collect());
    args.edit.finish(context, &edited, json!({ "map": map }))
}
