//! Writes the standard 3DGS PLY.

use super::{ANTIALIASED_MODE, EYE_COMMENT, MODE_COMMENT, ORIGIN_COMMENT, UP_COMMENT};
use crate::format::{Export, FirstView, LabelType, ModelWriter};
use glam::DVec3;
use labelgs_scene::{Error, Result, Setting};
use ply_rs_bw::ply::{Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType};
use ply_rs_bw::writer::Writer;
use std::io::{self, Write};

/// Floats of 32 bits represent all integers up to this one.
const FLOAT_EXACT: u32 = 1 << 24;

pub(super) const MODEL_WRITER: ModelWriter = ModelWriter { losses, write, checksum: None };

/// Refuses ids that a float would round.
fn losses(export: &Export) -> Result<Vec<String>> {
    let labels = export.labels().filter(|_| export.options.label_type == LabelType::Float).unwrap_or_default();
    let Some(label) = labels.iter().find(|&&label| label > FLOAT_EXACT) else { return Ok(Vec::new()) };
    let problem = format!(
        "label {label} is above {FLOAT_EXACT}, the limit of exact integers in floats; give it a smaller id, or \
         write labels as uint"
    );
    Err(Error::usage(Setting("label_type"), problem))
}

/// Writes a little-endian PLY with zero normals. The last column is `label` if the scene has labels; `label_confidence`
/// precedes it if known. Positions are 32-bit floats, because some readers accept nothing else. Positions that would be
/// rounded are relative to the origin in a comment.
fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    write_header(export, export.rows.len(), out)?;
    write_rows(export, out)
}

/// Writes the header of a file with `count` rows like those of an export.
pub(super) fn write_header(export: &Export, count: usize, out: &mut dyn Write) -> io::Result<()> {
    // The crate needs a sized writer for the header.
    let mut text = Vec::new();
    Writer::<DefaultElement>::new().write_header(&mut text, &header(export, count))?;
    out.write_all(&text)
}

/// Writes the rows of an export.
pub(super) fn write_rows(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let mut bytes = Vec::with_capacity((19 + export.model.rest_per_gaussian() * 3) * 4);
    export.rows.iter().try_for_each(|&row| write_row(export, row, &mut bytes, out))
}

fn header(export: &Export, count: usize) -> Header {
    let mut names: Vec<String> = ["x", "y", "z", "nx", "ny", "nz"].map(String::from).to_vec();
    names.extend((0..3).map(|k| format!("f_dc_{k}")));
    names.extend((0..export.model.rest_per_gaussian() * 3).map(|k| format!("f_rest_{k}")));
    names.push("opacity".into());
    names.extend((0..3).map(|k| format!("scale_{k}")));
    names.extend((0..4).map(|k| format!("rot_{k}")));
    names.extend(export.label_confidence().map(|_| "label_confidence".into()));
    let mut vertex = ElementDef::new("vertex".into());
    vertex.count = count;
    let mut add = |name, scalar| vertex.properties.add(PropertyDef::new(name, PropertyType::Scalar(scalar)));
    names.into_iter().for_each(|name| add(name, ScalarType::Float));
    if export.labels().is_some() {
        let is_uint = export.options.label_type == LabelType::Uint;
        add("label".into(), if is_uint { ScalarType::UInt } else { ScalarType::Float });
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    let mut say = |what: &str, DVec3 { x, y, z }| header.comments.push(format!("{what}{x:?} {y:?} {z:?}"));
    if export.origin != DVec3::ZERO {
        say(ORIGIN_COMMENT, export.origin);
    }
    if let Some(FirstView { up, eye }) = export.options.first_view {
        say(UP_COMMENT, up);
        say(EYE_COMMENT, eye);
    }
    if export.model.antialiased {
        header.comments.push(format!("{MODE_COMMENT}{ANTIALIASED_MODE}"));
    }
    header.elements.add(vertex);
    header
}

fn write_row(export: &Export, row: usize, bytes: &mut Vec<u8>, out: &mut dyn Write) -> io::Result<()> {
    bytes.clear();
    let g = export.model;
    let triples = export.model.rest(row);
    let head = export.position(row).into_iter().chain([0.0; 3]).chain(g.sh0[row]);
    let channels = (0..3).flat_map(|channel| triples.iter().map(move |triple| triple[channel]));
    let tail = [g.opacities[row]].into_iter().chain(g.scales[row]).chain(g.quats[row]);
    let share = export.label_confidence().map(|shares| shares[row]);
    head.chain(channels).chain(tail).chain(share).for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    if let Some(labels) = export.labels() {
        let label = labels[row];
        let is_uint = export.options.label_type == LabelType::Uint;
        bytes.extend_from_slice(&if is_uint { label.to_le_bytes() } else { (label as f32).to_le_bytes() });
    }
    out.write_all(bytes)
}
