//! `labelgs extract` and `labelgs remove`.

use super::args::JsonFlag;
use super::choose::ChooseArgs;
use super::context::Context;
use super::labelled::{Edited, MinConfidenceArg, open, wants_json};
use super::values::{distance, share};
use crate::Result;
use crate::edit::change::without_specks;
use crate::edit::components::Grouping;
use crate::edit::rename::keep;
use crate::edit::select::remove;
use clap::Args;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// `labelgs remove`, and most of `labelgs extract`.
#[derive(Args, Clone, Debug)]
pub struct SelectArgs {
    /// The model: a PLY, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write. Names of its labels go to OUT.labels.json beside it.
    #[arg(short, long, value_name = "OUT.ply")]
    pub output: PathBuf,
    /// Which labels.
    #[command(flatten)]
    pub choice: ChooseArgs,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// `labelgs extract`.
#[derive(Args, Clone, Debug)]
pub struct ExtractArgs {
    /// Model, choice and output.
    #[command(flatten)]
    pub select: SelectArgs,
    /// Which Gaussians of the labels.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Leave out specks: connected parts of a label that are smaller than --min-share.
    #[arg(long)]
    pub drop_specks: bool,
    /// What a speck is.
    #[command(flatten)]
    pub grouping: GroupingArgs,
}

/// Definition of connected parts and specks.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Connected parts")]
pub struct GroupingArgs {
    /// Least share of the label's Gaussians; a smaller part is a speck. The largest part never is one.
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.05)]
    pub min_share: f32,
    /// Largest gap between the ellipsoids (two standard deviations) of connected Gaussians, world units.
    #[arg(long, value_name = "DISTANCE", value_parser = distance, default_value_t = 0.0)]
    pub gap: f64,
}

impl GroupingArgs {
    /// Returns the rule for connected parts.
    pub fn grouping(&self) -> Grouping {
        Grouping { gap: self.gap, min_share: f64::from(self.min_share) }
    }
}

/// Writes the Gaussians of the chosen labels.
pub(crate) fn run_extract(args: &ExtractArgs, context: &Context) -> Result<()> {
    let select = &args.select;
    let (model, known) = open(&select.model, &select.choice.prompts.table)?;
    let labels = select.choice.labels(&select.model, &model, &known, context)?;
    let whole = args.sure.extract(&model, &listed(&labels))?;
    let part = if args.drop_specks { without_specks(&whole, args.grouping.grouping())? } else { whole.clone() };
    let edited = Edited {
        output: &select.output,
        model: &part,
        table: known.table.as_ref().map(|table| keep(table, |id| labels.contains(&id))),
        of: model.len(),
        labels: &labels,
    };
    edited.finish(wants_json(context, &select.json), json!({ "specks": whole.len() - part.len() }))
}

/// Writes the Gaussians of all other labels.
pub(crate) fn run_remove(args: &SelectArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.choice.prompts.table)?;
    let labels = args.choice.labels(&args.model, &model, &known, context)?;
    let part = remove(&model, &listed(&labels))?;
    let edited = Edited {
        output: &args.output,
        model: &part,
        table: known.table.as_ref().map(|table| keep(table, |id| !labels.contains(&id))),
        of: model.len(),
        labels: &labels,
    };
    edited.finish(wants_json(context, &args.json), json!({}))
}

fn listed(labels: &BTreeSet<u32>) -> Vec<u32> {
    labels.iter().copied().collect()
}
