//! `labelgs list`.

use crate::Result;
use crate::cli::support::model_edit::look;
use crate::cli::support::{Context, Seen, TableArg};
use crate::edit::select::LabelSummary;
use clap::Args;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs list`.
#[derive(Args, Clone, Debug)]
pub struct ListArgs {
    /// The model: a PLY, SPZ, GLB, SOG, USD or .splat, or the folder of a `labelgs train` run.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    #[command(flatten)]
    pub table: TableArg,
}

/// A label with its name.
#[derive(Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    summary: LabelSummary,
    name: Option<&'a str>,
}

/// Prints a row per label.
pub(crate) fn run(args: &ListArgs, context: &Context) -> Result<()> {
    let Seen { model, tally, known } = look(&args.model, &args.table)?;
    let row = |summary: LabelSummary| Row { name: known.name(summary.label), summary };
    let rows: Vec<Row> = tally.summaries().into_iter().map(row).collect();
    let names = if known.table.is_some() { "  name" } else { "" };
    let mut text =
        format!("{:>6} {:>10} {:>12}  {:^26}  {:^26}{names}\n", "label", "Gaussians", "opacity mass", "centre", "size");
    rows.iter().for_each(|row| text += &line(&row.summary, row.name));
    let result = json!({
        "schema_version": 1,
        "model": args.model.display().to_string(),
        "gaussians": known.gaussians.values().sum::<u64>(),
        "sh_degree": model.view().sh_degree(),
        "labels": rows,
    });
    context.show(&result, &text)
}

fn line(row: &LabelSummary, name: Option<&str>) -> String {
    let triple = |v: [f64; 3]| format!("{:>8.3} {:>8.3} {:>8.3}", v[0], v[1], v[2]);
    let size = [0, 1, 2].map(|axis| row.max[axis] - row.min[axis]);
    let label = if row.label == 0 { "none".to_owned() } else { row.label.to_string() };
    let name = name.map_or(String::new(), |name| format!("  {name}"));
    format!("{label:>6} {:>10} {:>12.1}  {}  {}{name}\n", row.count, row.opacity_mass, triple(row.centre), triple(size))
}
