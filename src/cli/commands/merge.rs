//! `labelgs merge`.

use crate::Result;
use crate::cli::support::parsers::{Picks, label, picks};
use crate::cli::support::{Context, EditArgs, EditResult};
use crate::edit::merge::{MergedLabels, merge};
use clap::Args;
use serde_json::json;

/// `labelgs merge`.
#[derive(Args, Clone, Debug)]
pub struct MergeArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Labels to merge, by id or name, such as 3,5 or cup,saucer.
    #[arg(long, value_name = "LABELS", value_parser = picks)]
    pub labels: Picks,
    /// Id of the merged label: one of --labels or a free id. Default: the smallest of --labels.
    #[arg(long, value_name = "ID", value_parser = label)]
    pub into: Option<u32>,
    /// Name of the merged label. Default: the name of --into, else the first name among --labels.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
}

/// Writes the model with several labels merged into one.
pub(crate) fn run(args: &MergeArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let labels = args.edit.resolve(&known, "--labels", &args.labels)?;
    let MergedLabels { model: merged, table, into } = merge(&model, &known, &labels, args.into, args.name.as_deref())?;
    let edited = EditResult::new(&merged, table, model.len(), [into].into());
    args.edit.finish(context, &edited, json!({ "merged": labels }))
}
