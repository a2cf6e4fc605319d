//! `labelgs recolour`.

use crate::Result;
use crate::cli::commands::extract_remove::SelectArgs;
use crate::cli::support::context::Context;
use crate::cli::support::model_edit::{Edited, open};
use crate::cli::support::parsers::{colour, share};
use crate::edit::change::recolour;
use clap::Args;
use serde_json::json;

/// `labelgs recolour`.
#[derive(Args, Clone, Debug)]
pub struct RecolourArgs {
    /// Model, choice and output.
    #[command(flatten)]
    pub select: SelectArgs,
    /// Colour of the labels: a name such as red, #rrggbb, or R,G,B from 0 to 1.
    #[arg(long, alias = "color", value_name = "COLOUR", value_parser = colour)]
    pub colour: [f32; 3],
    /// Share of the new colour, 0 to 1; the rest is the old colour, which keeps light and shade.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 1.0)]
    pub mix: f32,
}

/// Writes the model with the new colour.
pub(crate) fn run(args: &RecolourArgs, context: &Context) -> Result<()> {
    let select = &args.select;
    let (model, known) = open(&select.model, &select.choice.prompts.table)?;
    let labels = select.choice.labels(&select.model, &model, &known, context)?;
    let painted = recolour(&model, &labels, args.colour, args.mix);
    let table = known.table.clone();
    let edited = Edited { model: &painted, table, of: model.len(), added: 0, labels: &labels };
    let count: u64 = labels.iter().filter_map(|label| known.gaussians.get(label)).sum();
    edited.finish(&select.target(context), json!({ "recoloured": count }))
}
