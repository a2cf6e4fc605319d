//! `labelgs list`.

use super::args::ListArgs;
use super::{Context, open_model, stdout};
use crate::Result;
use crate::infer::select::{LabelSummary, summarise};
use serde_json::json;

/// Prints a row per label.
pub fn run(args: &ListArgs, context: &Context) -> Result<()> {
    let model = open_model(&args.model)?;
    let rows = summarise(&model);
    if context.json || args.json.json {
        return stdout::print_json(&json!({
            "schema_version": 1,
            "model": args.model.display().to_string(),
            "gaussians": model.len(),
            "sh_degree": model.sh_degree,
            "labels": rows,
        }));
    }
    let mut text =
        format!("{:>6} {:>10} {:>12}  {:^26}  {:^26}\n", "label", "Gaussians", "opacity mass", "centre", "size");
    rows.iter().for_each(|row| text += &line(row));
    stdout::print(&text)
}

fn line(row: &LabelSummary) -> String {
    let triple = |v: [f64; 3]| format!("{:>8.3} {:>8.3} {:>8.3}", v[0], v[1], v[2]);
    let size = [0, 1, 2].map(|axis| row.max[axis] - row.min[axis]);
    let label = if row.label == 0 { "none".to_owned() } else { row.label.to_string() };
    format!("{label:>6} {:>10} {:>12.1}  {}  {}\n", row.count, row.opacity_mass, triple(row.centre), triple(size))
}
