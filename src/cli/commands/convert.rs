//! `labelgs convert`.

use crate::Result;
use crate::cli::support::parsers::model_file;
use crate::cli::support::{Context, EditArgs, Edited, TableArg, WriteArgs};
use crate::edit::catalogue::Catalogue;
use crate::edit::rename::keep;
use crate::formats::export_model;
use crate::scene::{Gaussians, UNLABELLED};
use crate::words::counted;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// `labelgs convert`.
#[derive(Args, Clone, Debug)]
pub struct ConvertArgs {
    /// The model: a file that ends in .ply, .spz, .glb, .sog, .usda, .usdz, .splat or .html, or the folder of a `labelgs train`
    /// run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write; its ending is the format. Names of its labels go to OUT.labels.json beside it.
    #[arg(value_name = "OUT", value_parser = model_file())]
    pub output: PathBuf,
    /// Write a file for each label instead, such as OUT_003_cup.spz: the way to keep objects apart in programs without
    /// labels. Gaussians without a label go to OUT_000_none.spz.
    #[arg(long, help_heading = "Output")]
    pub per_object: bool,
    #[command(flatten)]
    pub write: WriteArgs,
    #[command(flatten)]
    pub table: TableArg,
}

/// Writes a model in another format.
pub(crate) fn run(args: &ConvertArgs, context: &Context) -> Result<()> {
    let ConvertArgs { model, output, write, table, .. } = args.clone();
    let edit = EditArgs { model, output, write, table };
    let (model, known) = edit.open()?;
    if args.per_object {
        return per_object(&edit, &model, &known, context);
    }
    let labels = known.gaussians.keys().copied().filter(|&label| label != UNLABELLED).collect();
    edit.finish(context, &Edited::new(&model, known.table, model.len(), labels), json!({}))
}

fn per_object(edit: &EditArgs, model: &Gaussians, known: &Catalogue, context: &Context) -> Result<()> {
    let (mut files, mut text) = (Vec::new(), String::new());
    let options = edit.write.options(&edit.model, &edit.output)?;
    for &label in known.gaussians.keys() {
        let name = known.name(label);
        let path = file_of(&edit.output, label, name);
        let part = model.filtered(|row| model.label(row) == label);
        let names = known.table.as_ref().map(|table| keep(table, |id| id == label));
        let left_out = export_model(&path, &part, names.as_ref(), options)?;
        let (path, count) = (path.display(), part.len() as u64 - left_out);
        files.push(json!({ "output": path.to_string(), "label": label, "name": name, "gaussians": count }));
        text += &format!("{path}: {count} of {}\n", counted(model.len(), "Gaussian"));
    }
    context.show(&json!({ "schema_version": 1, "of": model.len(), "files": files }), &text)
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
