//! Writes USD.

use super::{
    CONFIDENCE_ATTRIBUTE, DEGREE_ATTRIBUTE, HARMONICS_ATTRIBUTE, LABEL_TAXONOMY, MAGIC, OPACITIES_ATTRIBUTE,
    ORIENTATIONS_ATTRIBUTE, OWN_ANTIALIASED, OWN_DEGREE, OWN_DICTIONARY, OWN_EYE, OWN_LABEL, OWN_UP,
    POSITIONS_ATTRIBUTE, SCALES_ATTRIBUTE, SEMANTICS_PREFIX, SPLATS_SCHEMA, USD_AXES,
};
use crate::archive;
use crate::format::{Export, FirstView, ModelWriter};
use crate::values::{losses as losses_of_values, sigmoid, unit};
use glam::{DMat3, DQuat, DVec3};
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result, UNLABELLED};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write};

pub(super) const TEXT_WRITER: ModelWriter = ModelWriter { losses, write, checksum: None };
pub(super) const PACKAGE_WRITER: ModelWriter =
    ModelWriter { losses: losses_of_package, write: write_package, checksum: None };

/// Name of the layer in a package.
const LAYER_FILE: &str = "model.usda";
/// Alignment of files in a package, bytes.
const ALIGNMENT_BYTES: u16 = 64;
/// Most characters of a float including its separator: `(-1.1754944e-38, `.
const FLOAT_CHARACTERS_MAX: u64 = 17;
/// Visible radius of a Gaussian, in standard deviations.
const EXTENT_DEVIATIONS: f64 = 3.0;

fn losses(export: &Export) -> Result<Vec<String>> {
    if export.rows.is_empty() {
        return Err(Error::usage("USD", "this model has no Gaussians, so a stage would be empty"));
    }
    Ok(losses_of_values(export))
}

fn losses_of_package(export: &Export) -> Result<Vec<String>> {
    let floats = 12 + 3 * (1 + coefficients(written_degree(export))) as u64;
    let most = FLOAT_CHARACTERS_MAX * floats * export.rows.len() as u64;
    if most > u64::from(u32::MAX) {
        let problem = format!("a USDZ holds 4 GiB, but this model may take {most} bytes; write a .usda");
        return Err(Error::usage("USDZ", problem));
    }
    losses(export)
}

/// Returns the SH degree in the file: 0 or 3, because some renderers support no other.
fn written_degree(export: &Export) -> u32 {
    if export.model.sh_degree == 0 { 0 } else { 3 }
}

fn write_package(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let mut text = Vec::new();
    write(export, &mut text)?;
    out.write_all(&archive::pack(vec![(LAYER_FILE.into(), text)], ALIGNMENT_BYTES)?)
}

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let creator = concat!("labelgs ", env!("CARGO_PKG_VERSION"));
    let triple = |DVec3 { x, y, z }: DVec3| format!("({x:?}, {y:?}, {z:?})");
    let view = export.options.first_view.map_or(String::new(), |FirstView { up, eye }| {
        format!(
            "        dictionary {OWN_DICTIONARY} = {{\n            double3 {OWN_UP} = {}\n            double3 {OWN_EYE} = {}\n        }}\n",
            triple(up),
            triple(eye)
        )
    });
    write!(
        out,
        "{MAGIC}\n(\n    customLayerData = {{\n        string creator = \"{creator}\"\n{view}    }}\n    \
         defaultPrim = \"model\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n\
         def Xform \"model\" (\n    kind = \"component\"\n)\n{{\n"
    )?;
    if export.origin != DVec3::ZERO {
        let [x, y, z] = turned(export.origin).to_array();
        write!(
            out,
            "    double3 xformOp:translate = ({x:?}, {y:?}, {z:?})\n    \
             uniform token[] xformOpOrder = [\"xformOp:translate\"]\n\n"
        )?;
    }
    let mut objects: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for &row in export.rows {
        objects.entry(export.labels().map_or(UNLABELLED, |labels| labels[row])).or_default().push(row);
    }
    for (&label, rows) in &objects {
        prim(export, label, rows, out)?;
    }
    writeln!(out, "}}")
}

/// Converts a position to the axes of the file.
fn turned(place: DVec3) -> DVec3 {
    DVec3::from_array(USD_AXES.0.map(f64::from)) * place
}

/// Writes the Gaussians of a label as a prim.
fn prim(export: &Export, label: u32, rows: &[usize], out: &mut dyn Write) -> io::Result<()> {
    let g = export.model;
    let name = export.names.and_then(|names| names.name(label)).filter(|_| label != UNLABELLED);
    let title = name.map_or_else(|| format!("label_{label}"), str::to_owned);
    let identifier = if label == UNLABELLED { "gaussians".into() } else { identifier(name, label) };
    let mut own = String::new();
    if export.labels().is_some() {
        let _ = writeln!(own, "                int {OWN_LABEL} = {label}");
    }
    if written_degree(export) != g.sh_degree {
        let _ = writeln!(own, "                int {OWN_DEGREE} = {}", g.sh_degree);
    }
    if g.antialiased {
        let _ = writeln!(own, "                bool {OWN_ANTIALIASED} = 1");
    }
    writeln!(out, "    def {SPLATS_SCHEMA} \"{identifier}\" (")?;
    if label != UNLABELLED {
        writeln!(out, "        prepend apiSchemas = [\"SemanticsLabelsAPI:{LABEL_TAXONOMY}\"]")?;
    }
    if !own.is_empty() {
        write!(
            out,
            "        customData = {{\n            dictionary {OWN_DICTIONARY} = {{\n{own}            }}\n        }}\n"
        )?;
    }
    if let Some(name) = name {
        writeln!(out, "        displayName = {}", quoted(name))?;
    }
    write!(out, "    )\n    {{\n")?;
    if label != UNLABELLED {
        writeln!(out, "        token[] {SEMANTICS_PREFIX}{LABEL_TAXONOMY} = [{}]", quoted(&title))?;
    }
    attributes(export, rows, out)?;
    write!(out, "    }}\n\n")
}

fn attributes(export: &Export, rows: &[usize], out: &mut dyn Write) -> io::Result<()> {
    let g = export.model;
    let [low, high] = extent(export, rows);
    writeln!(out, "        float3[] extent = [{}, {}]", tuple(low), tuple(high))?;
    list(out, &format!("point3f[] {POSITIONS_ATTRIBUTE}"), rows, |row| tuple(USD_AXES.position(export.position(row))))?;
    list(out, &format!("quatf[] {ORIENTATIONS_ATTRIBUTE}"), rows, |row| tuple(unit(USD_AXES.quat(g.quats[row]))))?;
    list(out, &format!("float3[] {SCALES_ATTRIBUTE}"), rows, |row| tuple(g.scales[row].map(f32::exp)))?;
    list(out, &format!("float[] {OPACITIES_ATTRIBUTE}"), rows, |row| format!("{:?}", sigmoid(g.opacities[row])))?;
    let degree = written_degree(export);
    writeln!(out, "        uniform int {DEGREE_ATTRIBUTE} = {degree}")?;
    let zeros = vec![[0.0; 3]; coefficients(degree) - g.rest_per_gaussian()];
    list(out, &format!("float3[] {HARMONICS_ATTRIBUTE}"), rows, |row| {
        let mut rest = g.rest(row).to_vec();
        USD_AXES.rest(&mut rest);
        let all = [g.sh0[row]].into_iter().chain(rest).chain(zeros.iter().copied());
        all.map(tuple).collect::<Vec<_>>().join(", ")
    })?;
    write!(
        out,
        "        uniform token projectionModeHint = \"perspective\"\n        uniform token sortingModeHint = \"zDepth\"\n"
    )?;
    match export.label_confidence() {
        Some(shares) => {
            list(out, &format!("custom float[] {CONFIDENCE_ATTRIBUTE}"), rows, |row| format!("{:?}", shares[row]))
        }
        None => Ok(()),
    }
}

/// Writes an attribute with one line per Gaussian.
fn list(out: &mut dyn Write, attribute: &str, rows: &[usize], value: impl Fn(usize) -> String) -> io::Result<()> {
    writeln!(out, "        {attribute} = [")?;
    for (at, &row) in rows.iter().enumerate() {
        let end = if at + 1 < rows.len() { "," } else { "]" };
        writeln!(out, "{}{end}", value(row))?;
    }
    Ok(())
}

/// Formats numbers with the fewest digits that restore the same bits.
fn tuple<const N: usize>(values: [f32; N]) -> String {
    format!("({})", values.map(|value| format!("{value:?}")).join(", "))
}

/// Returns the bounding box of some rows' ellipsoids, in the axes of the file.
fn extent(export: &Export, rows: &[usize]) -> [[f32; 3]; 2] {
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for &row in rows {
        let [w, x, y, z] = unit(export.model.quats[row]).map(f64::from);
        let turn = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        let sizes = export.model.scales[row].map(|scale| EXTENT_DEVIATIONS * f64::from(scale).exp());
        let axes = turn * DMat3::from_diagonal(sizes.into());
        // Half the size of an ellipsoid's bounding box is the length of each row.
        let rows_of = axes.transpose();
        let half = DVec3::new(rows_of.x_axis.length(), rows_of.y_axis.length(), rows_of.z_axis.length());
        let centre = turned(DVec3::from_array(export.position(row).map(f64::from)));
        (low, high) = (low.min(centre - half), high.max(centre + half));
    }
    [low, high].map(|corner| corner.as_vec3().clamp(glam::Vec3::MIN, glam::Vec3::MAX).to_array())
}

/// Returns the identifier of a prim: ASCII only, because older programs refuse other letters, and unique by the label.
fn identifier(name: Option<&str>, label: u32) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.unwrap_or("label").chars().take(60).map(safe).collect();
    let start = if name.starts_with(|c: char| c.is_ascii_digit()) { "_" } else { "" };
    format!("{start}{name}_{label}")
}

/// Quotes a string.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted += "\\n",
            '\r' => quoted += "\\r",
            '\t' => quoted += "\\t",
            c if c.is_control() => quoted.push(' '),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
