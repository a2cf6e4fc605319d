//! `labelgs recolour`.

use crate::Result;
use crate::cli::support::parsers::{colour, share};
use crate::cli::support::{ChooseArgs, Context, EditArgs, EditResult};
use crate::edit::change::recolour;
use clap::Args;
use serde_json::json;

/// `labelgs recolour`.
#[derive(Args, Clone, Debug)]
pub struct RecolourArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    #[command(flatten)]
    pub choice: ChooseArgs,
    /// New colour: a name such as red, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, alias = "color", value_name = "COLOUR", value_parser = colour)]
    pub colour: [f32; 3],
    /// Share of the new colour, 0 to 1. Values below 1 keep some of the original shading.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 1.0)]
    pub mix: f32,
}

/// Writes the model with the new colour.
pub(crate) fn run(args: &RecolourArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let labels = args.choice.labels(&args.edit.model, &model, &known, context)?;
    let painted = recolour(&model, &labels, args.colour, args.mix);
    let count: u64 = labels.iter().filter_map(|label| known.gaussians.get(label)).sum();
    let edited = EditResult::new(&painted, known.table, model.len(), labels);
    args.edit.finish(context, &edited, json!({ "recoloured": count }))
}
