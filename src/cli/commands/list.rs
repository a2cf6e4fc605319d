//! `labelgs list`.

use crate::cli::support::model_edit::look;
use crate::cli::support::tables::{Column, Table, column, screen_width};
use crate::cli::support::{Context, LabelledModel, SheetArgs, TableArg, stdout};
use crate::edit::select::LabelSummary;
use crate::edit::{Boxes, OrientedBox};
use crate::run::models;
use crate::scene::UNLABELLED;
use crate::scene::gaussians::opacity_of;
use crate::{Error, Result};
use clap::Args;
use glam::DVec3;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs list`.
#[derive(Args, Clone, Debug)]
pub struct ListArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    #[command(flatten)]
    pub table: TableArg,
    /// Print the list as CSV: id, name, Gaussians, opacity, bounding box of the centres, and oriented bounding box with
    /// sizes and volume.
    #[arg(long, help_heading = "Output")]
    pub csv: bool,
    #[command(flatten)]
    pub sheet: SheetArgs,
}

/// A label with its name and size.
#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    summary: LabelSummary,
    /// The box along the axes of the object, without floaters; none without opacity.
    oriented: Option<OrientedBox>,
    name: Option<String>,
}

/// Prints a row per label.
pub(crate) fn run(args: &ListArgs, context: &Context) -> Result<()> {
    if args.csv && context.json {
        return Err(Error::usage("--csv", "cannot be combined with --json; use one of them"));
    }
    let LabelledModel { model, tally, known } = look(&args.model, &args.table)?;
    args.sheet.write(&args.model, &tally.summaries(), &known, context)?;
    let (view, mut boxes) = (model.view(), Boxes::new(&known.gaussians));
    models::scan(&args.model, view, |_, row| {
        let place = view.origin() + DVec3::from_array(row.position);
        let weight = opacity_of(row.opacity) * f64::from(row.confidence.unwrap_or(1.0));
        boxes.add(row.label.unwrap_or(UNLABELLED), place, weight, row.quat, row.scale);
    })?;
    let boxes = boxes.finish();
    let row = |summary: LabelSummary| Row {
        name: known.name(summary.label).map(str::to_owned),
        oriented: boxes.get(&summary.label).copied(),
        summary,
    };
    let rows: Vec<Row> = tally.summaries().into_iter().map(row).collect();
    if args.csv {
        return stdout::print(&csv(&rows)?);
    }
    let result = json!({
        "schema_version": 1,
        "model": args.model.display().to_string(),
        "gaussians": known.gaussians.values().sum::<u64>(),
        "sh_degree": model.view().sh_degree(),
        "labels": rows,
    });
    context.show(&result, &table(&rows))
}

/// Columns of numbers on a terminal: 60 wide for scenes of usual size.
const LABEL_COLUMNS: [Column<Row>; 7] = [
    column("Gaussians", "Gaussians", 0, |row| Some(row.summary.count as f64)),
    column("x", "x", 2, |row| Some(row.summary.centre[0])),
    column("y", "y", 2, |row| Some(row.summary.centre[1])),
    column("z", "z", 2, |row| Some(row.summary.centre[2])),
    column("length", "length", 2, |row| Some(row.oriented?.sizes[0])),
    column("width", "width", 2, |row| Some(row.oriented?.sizes[1])),
    column("depth", "depth", 2, |row| Some(row.oriented?.sizes[2])),
];

fn table(rows: &[Row]) -> String {
    let title = |row: &Row| match (row.summary.label, &row.name) {
        (UNLABELLED, _) => "none".to_owned(),
        (label, Some(name)) => format!("{label} {name}"),
        (label, None) => label.to_string(),
    };
    Table::new("label", &LABEL_COLUMNS, rows.iter().map(|row| (title(row), row))).text(screen_width())
}

/// Returns a row per label as CSV, with world units.
fn csv(rows: &[Row]) -> Result<String> {
    let places = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}_{axis}"));
    let numbers = |name: &str| ["1", "2", "3"].map(|number| format!("{name}_{number}"));
    let mut titles = ["label", "name", "gaussians", "opacity"].map(str::to_owned).to_vec();
    titles.extend(["min", "max", "centre", "box_centre"].into_iter().flat_map(places));
    titles.extend(numbers("box_size"));
    titles.extend(numbers("box_axis").iter().flat_map(|axis| places(axis)));
    titles.push("volume".to_owned());
    let mut out = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| Error::Bug(format!("CSV: {error}"));
    out.write_record(&titles).map_err(failed)?;
    for Row { summary, oriented, name } in rows {
        let known = [summary.min, summary.max, summary.centre].into_iter().flatten().map(Some);
        let parts = |found: &OrientedBox| [found.centre, found.sizes].into_iter().chain(found.axes).flatten().collect();
        let own: Vec<f64> = oriented.as_ref().map(parts).unwrap_or_default();
        let own = (0..15).map(|index| own.get(index).copied()).chain([oriented.map(|found| found.volume)]);
        let cell = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let first = [summary.label.to_string(), name.clone().unwrap_or_default(), summary.count.to_string()];
        let cells = [Some(summary.opacity_mass)].into_iter().chain(known).chain(own).map(cell);
        out.write_record(first.into_iter().chain(cells)).map_err(failed)?;
    }
    let bytes = out.into_inner().map_err(|error| Error::Bug(format!("CSV: {error}")))?;
    String::from_utf8(bytes).map_err(|error| Error::Bug(format!("CSV: {error}")))
}
