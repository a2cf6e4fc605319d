//! The standard 3DGS PLY. If the scene has labels, the last column is `property uint label`. If votes were counted,
//! `property float label_confidence` precedes it.

use super::format::{ModelFormat, ReadModel};
use crate::error::{Error, Result};
use crate::io::ply::Table;
use crate::scene::Gaussians;
use crate::scene::labels::LABEL_MAX;
use crate::scene::origin::far_origin;
use glam::DVec3;
use ply_rs_bw::ply::{Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType};
use ply_rs_bw::writer::Writer;
use std::io::{self, Write};
use std::path::Path;

/// Columns of every 3DGS PLY, in the order of decoding.
const REQUIRED: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];

/// Largest log-scale: the square of its exponential fits into f32, as covariances need it.
const LOG_SCALE_MAX: f32 = 44.0;
/// Fewest Gaussians for the check for activated values; with fewer, chance may look like it.
const ACTIVATED_MIN: usize = 16;

/// The format that viewers of 3DGS read.
pub(super) const FORMAT: ModelFormat = ModelFormat { name: "PLY", endings: &[".ply"], read, write };

/// Reads a 3DGS PLY: little-endian, big-endian or ascii, columns by name in any order and of any scalar type. The
/// number of `f_rest_*` (0, 9, 24 or 45, channel-major) gives the SH degree; `label` is optional; other columns are
/// ignored. Rows that cannot be rendered are dropped and counted. A label outside of the whole numbers 0 to 65535 is an
/// error.
fn read(path: &Path) -> Result<ReadModel> {
    let table = Table::open(path)?;
    let sh_degree = sh_degree(path, &table)?;
    if table.names().any(|name| name == "red") && !table.names().any(|name| name == "f_dc_0") {
        let problem = "holds coloured points, not Gaussians: it has `red` and no `f_dc_0`; train on them first";
        return Err(Error::data(path, "header", problem));
    }
    let mut read = ReadModel::default();
    read.gaussians.sh_degree = sh_degree;
    let rest = read.gaussians.rest_per_gaussian();
    let rest_names: Vec<String> = (0..rest * 3).map(|index| format!("f_rest_{index}")).collect();
    let mut columns = REQUIRED.to_vec();
    columns.extend(rest_names.iter().map(String::as_str));
    let labelled = table.names().any(|name| name == "label");
    if labelled {
        columns.push("label");
        read.gaussians.labels = Some(Vec::new());
    }
    let confident = labelled && table.names().any(|name| name == "label_confidence");
    if confident {
        columns.push("label_confidence");
        read.gaussians.label_confidence = Some(Vec::new());
    }
    let mut dropped = Dropped::default();
    let mut positions = Vec::new();
    let mut total = 0;
    let odd = table.for_each(&columns, |index, row| {
        total = index + 1;
        let (row, labelling) = row.split_at(14 + rest * 3);
        let label = labelling.first().map(|&label| label_of(path, index, label)).transpose()?;
        let confidence = labelling.get(1).map(|&share| confidence_of(path, index, share)).transpose()?;
        if let Some(position) = push_row(&mut read.gaussians, &mut dropped, row, label, confidence) {
            positions.push(position);
        }
        Ok(())
    })?;
    let origin = far_origin(&positions);
    read.gaussians.origin = origin;
    read.gaussians.means = positions.iter().map(|&position| (position - origin).as_vec3().to_array()).collect();
    read.dropped = dropped.total();
    if read.dropped > 0 {
        read.notes.push(format!("left out {} of {total} Gaussians: {}", read.dropped, dropped.reasons()));
    }
    if looks_activated(&read.gaussians) {
        let note = "every opacity is from 0 to 1 and every scale positive: they seem to be written after their sigmoid \
                    and exponential, but a 3DGS PLY has the values before; such a model looks like fog";
        read.notes.push(note.to_owned());
    }
    if odd.extra_bytes > 0 {
        read.notes.push(format!("{} bytes after the last Gaussian were ignored", odd.extra_bytes));
    }
    Ok(read)
}

/// Returns true if the values look activated, although the format stores logits and logarithms.
fn looks_activated(gaussians: &Gaussians) -> bool {
    gaussians.len() >= ACTIVATED_MIN
        && gaussians.opacities.iter().all(|opacity| (0.0..=1.0).contains(opacity))
        && gaussians.scales.iter().flatten().all(|&scale| scale > 0.0)
}

/// Returns the degree for the number of `f_rest_*` columns.
fn sh_degree(path: &Path, table: &Table) -> Result<u32> {
    let count = table.names().filter(|name| name.starts_with("f_rest_")).count();
    match count {
        0 => Ok(0),
        9 => Ok(1),
        24 => Ok(2),
        45 => Ok(3),
        _ => {
            let problem = format!("{count} `f_rest_` properties; 0, 9, 24 or 45 (SH degree 0 to 3) are supported");
            Err(Error::data(path, "header", problem))
        }
    }
}

fn label_of(path: &Path, index: u64, value: f64) -> Result<u32> {
    if value.fract() == 0.0 && (0.0..=f64::from(LABEL_MAX)).contains(&value) {
        return Ok(value as u32);
    }
    let problem =
        format!("label {value} is not a whole number from 0 (unlabelled) to {LABEL_MAX}; renumber the labels");
    Err(Error::data(path, format!("vertex {index}"), problem))
}

fn confidence_of(path: &Path, index: u64, value: f64) -> Result<f32> {
    if (0.0..=1.0).contains(&value) {
        return Ok(value as f32);
    }
    let problem = format!("label_confidence {value} is not from 0 to 1; correct it or leave out the column");
    Err(Error::data(path, format!("vertex {index}"), problem))
}

#[derive(Default)]
struct Dropped {
    not_finite: u64,
    no_rotation: u64,
    too_large: u64,
}

impl Dropped {
    fn total(&self) -> u64 {
        self.not_finite + self.no_rotation + self.too_large
    }

    fn reasons(&self) -> String {
        let all = [
            (self.not_finite, "with a value that is not finite"),
            (self.no_rotation, "with a zero rotation"),
            (self.too_large, "with an infinite size"),
        ];
        let some: Vec<String> = all.iter().filter(|r| r.0 > 0).map(|(count, why)| format!("{count} {why}")).collect();
        some.join(", ")
    }
}

/// Appends a row in the order of [`REQUIRED`] and `f_rest_*` and returns its position, which is not appended; or counts
/// the reason for leaving it out.
fn push_row(
    to: &mut Gaussians,
    dropped: &mut Dropped,
    row: &[f64],
    label: Option<u32>,
    confidence: Option<f32>,
) -> Option<DVec3> {
    let value = |index: usize| row[index] as f32;
    if (0..row.len()).any(|index| !value(index).is_finite()) {
        dropped.not_finite += 1;
        return None;
    }
    let scales = [value(7), value(8), value(9)];
    if scales.iter().any(|&scale| scale > LOG_SCALE_MAX) {
        dropped.too_large += 1;
        return None;
    }
    let Some(quat) = rotation([row[10], row[11], row[12], row[13]]) else {
        dropped.no_rotation += 1;
        return None;
    };
    to.sh0.push([value(3), value(4), value(5)]);
    to.opacities.push(value(6));
    to.scales.push(scales);
    to.quats.push(quat);
    let rest = to.rest_per_gaussian();
    to.sh_rest.extend((0..rest).map(|k| [value(14 + k), value(14 + rest + k), value(14 + 2 * rest + k)]));
    if let (Some(labels), Some(label)) = (to.labels.as_mut(), label) {
        labels.push(label);
    }
    if let (Some(shares), Some(share)) = (to.label_confidence.as_mut(), confidence) {
        shares.push(share);
    }
    Some(DVec3::new(row[0], row[1], row[2]))
}

/// Returns the rotation as stored, normalised only if its squared length does not fit into f32; `None` for zero.
fn rotation(quat: [f64; 4]) -> Option<[f32; 4]> {
    let length = quat.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length == 0.0 {
        return None;
    }
    let usual = (1e-6..=1e6).contains(&length);
    Some(quat.map(|v| if usual { v as f32 } else { (v / length) as f32 }))
}

/// Writes the standard 3DGS PLY (little-endian, no comments, zero normals). `label` is the last column if the scene has
/// labels; `label_confidence` precedes it if known. Positions are world positions. They are doubles where floats would
/// round them, which happens only far from the origin.
fn write(out: &mut dyn Write, gaussians: &Gaussians, rows: &[usize]) -> io::Result<()> {
    let rest = gaussians.rest_per_gaussian();
    let wide = gaussians.origin != DVec3::ZERO
        && rows.iter().any(|&row| gaussians.world(row) != gaussians.world(row).as_vec3().as_dvec3());
    // The crate needs a sized writer for the header.
    let mut text = Vec::new();
    Writer::<DefaultElement>::new().write_header(&mut text, &header(rows.len(), rest * 3, gaussians, wide))?;
    out.write_all(&text)?;
    let mut bytes = Vec::with_capacity((18 + rest * 3) * 4);
    rows.iter().try_for_each(|&row| write_row(out, &mut bytes, gaussians, row, wide))
}

fn header(count: usize, rest: usize, gaussians: &Gaussians, wide: bool) -> Header {
    let mut names: Vec<String> = ["x", "y", "z", "nx", "ny", "nz"].map(String::from).to_vec();
    names.extend((0..3).map(|k| format!("f_dc_{k}")));
    names.extend((0..rest).map(|k| format!("f_rest_{k}")));
    names.push("opacity".into());
    names.extend((0..3).map(|k| format!("scale_{k}")));
    names.extend((0..4).map(|k| format!("rot_{k}")));
    let mut vertex = ElementDef::new("vertex".into());
    vertex.count = count;
    for (index, name) in names.into_iter().enumerate() {
        let scalar = if wide && index < 3 { ScalarType::Double } else { ScalarType::Float };
        vertex.properties.add(PropertyDef::new(name, PropertyType::Scalar(scalar)));
    }
    if gaussians.labels.is_some() {
        if gaussians.label_confidence.is_some() {
            let share = PropertyDef::new("label_confidence".into(), PropertyType::Scalar(ScalarType::Float));
            vertex.properties.add(share);
        }
        vertex.properties.add(PropertyDef::new("label".into(), PropertyType::Scalar(ScalarType::UInt)));
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.add(vertex);
    header
}

fn write_row(out: &mut dyn Write, bytes: &mut Vec<u8>, g: &Gaussians, row: usize, wide: bool) -> io::Result<()> {
    bytes.clear();
    let rest = g.rest_per_gaussian();
    let triples = &g.sh_rest[row * rest..(row + 1) * rest];
    let place = g.world(row).to_array();
    if wide {
        place.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    } else {
        place.iter().for_each(|&value| bytes.extend_from_slice(&(value as f32).to_le_bytes()));
    }
    let head = [0.0; 3].into_iter().chain(g.sh0[row]);
    let channels = (0..3).flat_map(|channel| triples.iter().map(move |triple| triple[channel]));
    let tail = [g.opacities[row]].into_iter().chain(g.scales[row]).chain(g.quats[row]);
    head.chain(channels).chain(tail).for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    if let Some(labels) = &g.labels {
        if let Some(shares) = &g.label_confidence {
            bytes.extend_from_slice(&shares[row].to_le_bytes());
        }
        bytes.extend_from_slice(&labels[row].to_le_bytes());
    }
    out.write_all(bytes)
}
