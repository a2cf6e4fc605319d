//! `labelgs recolour`.

use super::Context;
use super::args::JsonFlag;
use super::choose::ChooseArgs;
use super::labelled::{Edited, open, wants_json};
use super::values::{colour, share};
use crate::Result;
use crate::infer::edit::recolour;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs recolour`.
#[derive(Args, Clone, Debug)]
pub struct RecolourArgs {
    /// The model: a PLY, or the folder that `labelgs train` made.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Colour of the labels: black, white, or R,G,B from 0 to 1.
    #[arg(long, value_name = "COLOUR", value_parser = colour)]
    pub colour: [f32; 3],
    /// Share of that colour; below 1 the rest is the old one, with its light and shade.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 1.0)]
    pub mix: f32,
    /// File to write; names of its labels go to OUT.labels.json beside it.
    #[arg(short, long, value_name = "OUT.ply")]
    pub output: PathBuf,
    /// Which labels.
    #[command(flatten)]
    pub choice: ChooseArgs,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Writes the model with the colour.
pub fn run(args: &RecolourArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.choice.prompts.table)?;
    let labels = args.choice.labels(&args.model, &model, &known, context)?;
    let painted = recolour(&model, &labels, args.colour, args.mix);
    let table = known.table.clone();
    let edited = Edited { output: &args.output, model: &painted, table, of: model.len(), labels: &labels };
    let count: u64 = labels.iter().filter_map(|label| known.gaussians.get(label)).sum();
    edited.finish(wants_json(context, &args.json), json!({ "recoloured": count }))
}
