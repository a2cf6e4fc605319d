//! `labelgs merge`.

use super::context::Context;
use super::labelled::{EditArgs, Edited, open, wants_json};
use super::values::{Picks, label, picks};
use crate::edit::change::relabel;
use crate::edit::rename::{give_name, renumber};
use crate::scene::UNLABELLED;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};

/// `labelgs merge`.
#[derive(Args, Clone, Debug)]
pub struct MergeArgs {
    /// Model and output.
    #[command(flatten)]
    pub edit: EditArgs,
    /// The labels to merge, by id or by name, such as 3,5 or cup,saucer.
    #[arg(long, value_name = "LABELS", value_parser = picks)]
    pub labels: Picks,
    /// Id of the result: one of --labels or a free id. Default: the smallest of --labels.
    #[arg(long, value_name = "ID", value_parser = label)]
    pub into: Option<u32>,
    /// Name of the result. Default: the name of the label with that id, or the first name among the others.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
}

/// Writes the model with several labels merged into one.
pub(crate) fn run(args: &MergeArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.edit.model, &args.edit.table)?;
    let labels = known.resolve("--labels", &args.labels.0)?;
    let smallest = labels.iter().copied().find(|&label| label != UNLABELLED);
    let into = match args.into.or(smallest) {
        Some(UNLABELLED) | None => {
            return Err(Error::usage("--into", "0 means no label; `labelgs relabel` removes labels"));
        }
        Some(into) => into,
    };
    if known.gaussians.contains_key(&into) && !labels.contains(&into) {
        let problem = format!("label {} is another one; add it to --labels, or choose a free id", known.title(into));
        return Err(Error::usage("--into", problem));
    }
    let map: BTreeMap<u32, u32> = labels.iter().map(|&label| (label, into)).collect();
    let merged = relabel(&model, &map);
    let mut table = known.table.as_ref().map(|table| renumber(table, &map));
    if let Some(name) = &args.name {
        let ids = crate::edit::catalogue::Catalogue::new(&merged, None);
        table = Some(give_name(&ids, table, into, name)?);
    }
    let labels = BTreeSet::from([into]);
    let (output, write) = (&args.edit.output, args.edit.write);
    let edited = Edited { output, model: &merged, table, write, of: model.len(), labels: &labels };
    edited.finish(wants_json(context, &args.edit.json), json!({ "merged": map.keys().collect::<Vec<_>>() }))
}
