//! `labelgs convert`.

use crate::cli::support::model_edit::require_labels;
use crate::cli::support::parsers::{Picks, model_file, picks};
use crate::cli::support::{Context, EditArgs, EditResult, TableArg, WriteArgs, open_gpu};
use crate::edit::catalogue::Catalogue;
use crate::edit::rename::keep;
use crate::formats::{Mesh, export_model, write_meshes};
use crate::render::mesh::{CELLS_DEFAULT, CELLS_MAX, CELLS_MIN, object_mesh};
use crate::scene::{Gaussians, UNLABELLED};
use crate::scenes::camera_json::views_of_model;
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use glam::DVec3;
use serde_json::json;
use std::path::{Path, PathBuf};

/// `labelgs convert`.
#[derive(Args, Clone, Debug)]
pub struct ConvertArgs {
    /// Model: a .ply, .spz, .glb, .sog, .usda, .usdz, .splat or .html file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// File to write; its extension decides the format. Label names go to OUT.labels.json beside it.
    #[arg(value_name = "OUT", value_parser = model_file())]
    pub output: PathBuf,
    /// Write one file per object, such as OUT_003_cup.spz, for programs that do not read labels. Gaussians without a
    /// label go to OUT_000_none.spz.
    #[arg(long, help_heading = "Output")]
    pub per_object: bool,
    /// Write closed triangle meshes with vertex colours to a GLB, one node per object. Parts that no camera of the run
    /// saw are closed. A model without a run is treated as seen from all sides.
    #[arg(long, help_heading = "Output", conflicts_with = "per_object")]
    pub mesh: bool,
    /// With --mesh, write only these labels, such as 1,4-6,cup.
    #[arg(long, value_name = "LABELS", value_parser = picks, help_heading = "Output", requires = "mesh")]
    pub labels: Option<Picks>,
    /// With --mesh, grid cells along the longest side of an object.
    #[arg(
        long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(i64::from(CELLS_MIN)..=i64::from(CELLS_MAX)),
        default_value_t = CELLS_DEFAULT, help_heading = "Output", requires = "mesh"
    )]
    pub mesh_cells: u32,
    #[command(flatten)]
    pub write: WriteArgs,
    #[command(flatten)]
    pub table: TableArg,
}

/// Writes a model in another format.
pub(crate) fn run(args: &ConvertArgs, context: &Context) -> Result<()> {
    let ConvertArgs { model, output, write, table, .. } = args.clone();
    if args.mesh && output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("glb")) {
        let problem = format!("{} is not a .glb file; meshes are written as GLB only", output.display());
        return Err(Error::usage("--mesh", problem));
    }
    let edit = EditArgs { model, output, write, table };
    let (model, known) = edit.open()?;
    if args.per_object {
        return per_object(&edit, &model, &known, context);
    }
    if args.mesh {
        return meshes(args, &edit, (&model, &known), context);
    }
    let labels = known.gaussians.keys().copied().filter(|&label| label != UNLABELLED).collect();
    edit.finish(context, &EditResult::new(&model, known.table, model.len(), labels), json!({}))
}

fn per_object(edit: &EditArgs, model: &Gaussians, known: &Catalogue, context: &Context) -> Result<()> {
    let (mut files, mut text) = (Vec::new(), String::new());
    for &label in known.gaussians.keys() {
        let name = known.name(label);
        let path = file_of(&edit.output, label, name);
        let part = model.filtered(|row| model.label(row) == label);
        let names = known.table.as_ref().map(|table| keep(table, |id| id == label));
        let options = edit.write.options_of_part(&edit.model, &path, &part)?;
        let left_out = export_model(&path, &part, names.as_ref(), options)?;
        let (path, count) = (path.display(), part.len() as u64 - left_out);
        files.push(json!({ "output": path.to_string(), "label": label, "name": name, "gaussians": count }));
        text += &format!("{path}: {count} of {}\n", counted(model.len(), "Gaussian"));
    }
    context.show(&json!({ "schema_version": 1, "of": model.len(), "files": files }), &text)
}

/// Writes the surfaces of some labels.
fn meshes(
    args: &ConvertArgs,
    edit: &EditArgs,
    (model, known): (&Gaussians, &Catalogue),
    context: &Context,
) -> Result<()> {
    require_labels(&edit.model, model.labels.is_some())?;
    let labels = match &args.labels {
        Some(picks) => edit.resolve(known, "--labels", picks)?,
        None => known.gaussians.keys().copied().filter(|&label| label != UNLABELLED).collect(),
    };
    let cameras: Vec<DVec3> = views_of_model(&edit.model)?.iter().map(|view| view.camera.centre()).collect();
    let gpu = open_gpu(context)?;
    let (mut meshes, mut rows, mut text) = (Vec::new(), Vec::new(), String::new());
    for label in labels {
        let name = known.name(label).map_or_else(|| format!("label_{label}"), str::to_owned);
        let mesh = object_mesh(&gpu, model, label, &cameras, args.mesh_cells).map_err(|error| match error {
            Error::Usage { problem, .. } => Error::usage("--labels", format!("{}: {problem}", known.title(label))),
            other => other,
        })?;
        let (corners, triangles) = (mesh.positions.len(), mesh.triangles.len());
        rows.push(json!({ "label": label, "name": name, "vertices": corners, "triangles": triangles }));
        text += &format!("{}: {}\n", known.title(label), counted(triangles, "triangle"));
        meshes.push(Mesh { name, ..mesh });
    }
    write_meshes(&edit.output, &meshes)?;
    let output = edit.output.display().to_string();
    context.show(&json!({ "schema_version": 1, "output": output, "meshes": rows }), &text)
}

/// The file of a label: its id and name before the extension. Characters that a file system may refuse become `_`.
fn file_of(output: &Path, label: u32, name: Option<&str>) -> PathBuf {
    let safe = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let own = if label == UNLABELLED { Some("none") } else { name };
    let own: String = own.map(|name| format!("_{name}")).unwrap_or_default().chars().take(60).map(safe).collect();
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let extension = output.extension().map(|extension| format!(".{}", extension.to_string_lossy())).unwrap_or_default();
    output.with_file_name(format!("{stem}_{label:03}{own}{extension}"))
}
