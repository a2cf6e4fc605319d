//! The standard 3DGS PLY. If the scene has labels, the last column is `label`. If votes were counted, `property float
//! label_confidence` precedes it.

mod joined;
mod packed;
mod write;

pub(crate) use joined::write_joined;

use super::format::{ModelFormat, ReadModel};
use super::rows::{Row, Rows};
use crate::error::{Error, Result};
use crate::io::ply::Table;
use crate::scene::Gaussians;
use crate::scene::labels::LABEL_MAX;
use glam::DVec3;
use std::path::Path;

/// Columns of every 3DGS PLY, in the order of decoding.
const REQUIRED: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];

/// Bits of the column `state` that editors of Gaussians write.
const SELECTED: u8 = 1;
const DELETED: u8 = 4;
/// Start of the comment with the world position of the file's (0, 0, 0).
const ORIGIN: &str = "labelgs world_origin ";
/// Start of the comment with how viewers draw the model (Brush, PlayCanvas), and its value for antialiased models.
const MODE: &str = "SplatRenderMode: ";
const ANTIALIASED: &str = "mip";
/// The comment of Postshot's antialiased models.
const ANTIALIASED_POSTSHOT: &str = "antialiased 1";
/// Fewest Gaussians for the check for activated values; with fewer, chance may look like it.
const ACTIVATED_MIN: usize = 16;

/// The format that viewers of 3DGS read.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "PLY", endings: &[".ply"], read, write: Some(write::WRITER) };

/// Reads a 3DGS PLY: little-endian, big-endian or ascii, columns by name in any order and of any scalar type. The
/// number of `f_rest_*` (0, 9, 24 or 45, channel-major) gives the SH degree; `label` is optional; other columns are
/// ignored. Without `label`, the selection in the `state` of an editor is label 1. Rows that cannot be rendered are
/// dropped and counted. A compressed PLY is read too. A label outside of the whole numbers 0 to 65535 is an error.
fn read(path: &Path) -> Result<ReadModel> {
    if let Some(read) = packed::read(path)? {
        return Ok(read);
    }
    let table = Table::open(path)?;
    let sh_degree = sh_degree(path, &table)?;
    let has = |name: &str| table.names().any(|found| found == name);
    if has("red") && !has("f_dc_0") {
        let problem = "holds coloured points, not Gaussians: it has `red` and no `f_dc_0`; train on them first";
        return Err(Error::data(path, "header", problem));
    }
    let rest = ((sh_degree + 1) * (sh_degree + 1) - 1) as usize;
    let rest_names: Vec<String> = (0..rest * 3).map(|index| format!("f_rest_{index}")).collect();
    let mut columns = REQUIRED.to_vec();
    columns.extend(rest_names.iter().map(String::as_str));
    let (labelled, edited) = (has("label"), !has("label") && has("state"));
    let confident = labelled && has("label_confidence");
    columns.extend(labelled.then_some("label"));
    columns.extend(confident.then_some("label_confidence"));
    columns.extend(edited.then_some("state"));
    let (origin, antialiased) = (origin(path, &table)?, is_antialiased(table.comments()));
    let mut rows = Rows::new(sh_degree, labelled || edited, confident);
    let mut triples = vec![[0.0; 3]; rest];
    let mut deleted = 0;
    let odd = table.for_each(&columns, |index, row| {
        let (row, labelling) = row.split_at(14 + rest * 3);
        let value = |index: usize| row[index] as f32;
        for (k, triple) in triples.iter_mut().enumerate() {
            *triple = [value(14 + k), value(14 + rest + k), value(14 + 2 * rest + k)];
        }
        let mut label = None;
        if labelled {
            label = Some(label_of(path, index, labelling[0])?);
        } else if edited {
            let state = labelling[0] as u8;
            if state & DELETED != 0 {
                deleted += 1;
                return Ok(());
            }
            label = Some(u32::from(state & SELECTED));
        }
        rows.push(&Row {
            position: [row[0], row[1], row[2]],
            sh0: [value(3), value(4), value(5)],
            opacity: value(6),
            scale: [value(7), value(8), value(9)],
            quat: [row[10], row[11], row[12], row[13]],
            rest: &triples,
            label,
            confidence: labelling.get(1).map(|&share| confidence_of(path, index, share)).transpose()?,
        });
        Ok(())
    })?;
    let mut read = rows.finish(path, origin)?;
    read.gaussians.antialiased = antialiased;
    read.dropped += deleted;
    let deleted = edited.then_some(deleted);
    add_notes(&mut read, deleted, odd.extra_bytes);
    Ok(read)
}

/// Adds what the user should know; `deleted` is the number of Gaussians that an editor has deleted, if it was one.
fn add_notes(read: &mut ReadModel, deleted: Option<u64>, extra_bytes: u64) {
    if let Some(deleted) = deleted {
        let note = "the selection in the column `state` became label 1";
        let more = if deleted > 0 { format!("; {deleted} deleted Gaussians were left out") } else { String::new() };
        read.notes.push(format!("{note}{more}"));
    }
    if looks_activated(&read.gaussians) {
        let note = "every opacity is from 0 to 1 and every scale positive: they seem to be written after their sigmoid \
                    and exponential, but a 3DGS PLY has the values before; such a model looks like fog";
        read.notes.push(note.to_owned());
    }
    if extra_bytes > 0 {
        read.notes.push(format!("{} bytes after the last Gaussian were ignored", extra_bytes));
    }
}

/// Returns true if the comments of a header say that the model is antialiased.
fn is_antialiased<'a>(mut comments: impl Iterator<Item = &'a str>) -> bool {
    comments.any(|comment| {
        let comment = comment.trim();
        comment.strip_prefix(MODE).is_some_and(|mode| mode.trim() == ANTIALIASED) || comment == ANTIALIASED_POSTSHOT
    })
}

/// Returns the origin in the comments of the header.
fn origin(path: &Path, table: &Table) -> Result<Option<DVec3>> {
    let Some(words) = table.comments().find_map(|comment| comment.trim().strip_prefix(ORIGIN)) else {
        return Ok(None);
    };
    let numbers: Vec<f64> = words.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
    match *numbers {
        [x, y, z] if DVec3::new(x, y, z).as_vec3().is_finite() => Ok(Some(DVec3::new(x, y, z))),
        _ => {
            let problem =
                format!("the comment `{ORIGIN}{words}` does not end with three numbers; correct or remove it");
            Err(Error::data(path, "header", problem))
        }
    }
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
