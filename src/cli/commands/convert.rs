//! `labelgs convert`.

use crate::Result;
use crate::cli::support::args::JsonFlag;
use crate::cli::support::context::Context;
use crate::cli::support::model_edit::{Edited, TableArg, Target, open, wants_json};
use crate::cli::support::model_format::WriteArgs;
use crate::cli::support::parsers::model_file;
use crate::cli::support::stdout;
use crate::edit::catalogue::Catalogue;
use crate::edit::rename::keep;
use crate::formats::export_model;
use crate::scene::{Gaussians, UNLABELLED};
use crate::words::counted;
use clap::Args;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// `labelgs convert`.
#[derive(Args, Clone, Debug)]
pub struct ConvertArgs {
    /// The model: a file that ends in .ply, .spz, .glb, .sog, .splat or .html, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write; its ending is the format. Names of its labels go to OUT.labels.json beside it.
    #[arg(value_name = "OUT", value_parser = model_file())]
    pub output: PathBuf,
    /// Write a file for each label instead, such as OUT_003_cup.spz: the way to keep objects apart in programs without
    /// labels. Gaussians without a label go to OUT_000_none.spz.
    #[arg(long, help_heading = "Output")]
    pub per_object: bool,
    /// How it is written.
    #[command(flatten)]
    pub write: WriteArgs,
    /// Names.
    #[command(flatten)]
    pub table: TableArg,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Writes a model in another format.
pub(crate) fn run(args: &ConvertArgs, context: &Context) -> Result<()> {
    let (model, known) = open(&args.model, &args.table)?;
    let labels: BTreeSet<u32> = known.gaussians.keys().copied().filter(|&label| label != UNLABELLED).collect();
    let print_json = wants_json(context, &args.json);
    if args.per_object {
        return per_object(args, &model, &known, print_json);
    }
    let edited = Edited { model: &model, table: known.table, of: model.len(), added: 0, labels: &labels };
    edited.finish(&Target::new((&args.model, &args.output), args.write, print_json), json!({}))
}

fn per_object(args: &ConvertArgs, model: &Gaussians, known: &Catalogue, print_json: bool) -> Result<()> {
    let mut files = Vec::new();
    let options = args.write.options(&args.model, &args.output)?;
    for &label in known.gaussians.keys() {
        let name = known.name(label);
        let path = file_of(&args.output, label, name);
        let part = model.filtered(|row| model.label(row) == label);
        let names = known.table.as_ref().map(|table| keep(table, |id| id == label));
        let left_out = export_model(&path, &part, names.as_ref(), options)?;
        files.push((path, label, name, part.len() as u64 - left_out));
    }
    if print_json {
        let rows = files.iter().map(|(path, label, name, count)| {
            json!({ "output": path.display().to_string(), "label": label, "name": name, "gaussians": count })
        });
        return stdout::print_json(&json!({
            "schema_version": 1,
            "of": model.len(),
            "files": rows.collect::<Vec<_>>(),
        }));
    }
    let lines = files
        .iter()
        .map(|(path, _, _, count)| format!("{}: {count} of {}\n", path.display(), counted(model.len(), "Gaussian")));
    stdout::print(&lines.collect::<String>())
}

/// The file of a label: its id and name before the ending. Characters that a file system may refuse become `_`.
fn file_of(output: &Path, label: u32, name: Option<&str>) -> PathBuf {
    let safe = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let own = if label == UNLABELLED { Some("none") } else { name };
    let own: String = own.map(|name| format!("_{name}")).unwrap_or_default().chars().take(60).map(safe).collect();
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let ending = output.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    output.with_file_name(format!("{stem}_{label:03}{own}{ending}"))
}
