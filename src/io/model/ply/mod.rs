//! The standard 3DGS PLY. If the scene has labels, the last column is `label`. If votes were counted, `property float
//! label_confidence` precedes it.

mod columns;
mod joined;
mod packed;
mod stored;
mod write;

pub(crate) use joined::write_joined;

use super::format::{ModelFormat, ReadModel};
use crate::error::{Error, Result};
use crate::io::ply::Table;
use columns::Columns;
use glam::DVec3;
use std::path::Path;

pub use stored::StoredModel;

/// Start of the comment with the world position of the file's (0, 0, 0).
const ORIGIN: &str = "labelgs world_origin ";
/// Start of the comment with how viewers draw the model (Brush, PlayCanvas), and its value for antialiased models.
const MODE: &str = "SplatRenderMode: ";
const ANTIALIASED: &str = "mip";
/// The comment of Postshot's antialiased models.
const ANTIALIASED_POSTSHOT: &str = "antialiased 1";

/// The format that viewers of 3DGS read.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "PLY", endings: &[".ply"], read, write: Some(write::WRITER) };

/// Reads a 3DGS PLY: little-endian, big-endian or ascii, columns by name in any order and of any scalar type. The
/// number of `f_rest_*` (0, 9, 24 or 45, channel-major) gives the SH degree; `label` is optional; other columns are
/// ignored. Without `label`, the selection in the `state` of an editor is label 1. Rows that cannot be rendered are
/// dropped and counted. A compressed PLY is read too. A label that is no whole number from 0 to [`MODEL_LABEL_MAX`] is an
/// error.
///
/// [`MODEL_LABEL_MAX`]: crate::scene::MODEL_LABEL_MAX
fn read(path: &Path) -> Result<ReadModel> {
    if let Some(read) = packed::read(path)? {
        return Ok(read);
    }
    let table = Table::open(path)?;
    let columns = Columns::of(path, &table)?;
    let (origin, antialiased) = (origin(path, &table)?, is_antialiased(table.comments()));
    let (mut rows, mut triples, mut deleted) = (columns.rows(), columns.triples(), 0);
    let odd = table.for_each(&columns.names(), |index, values| {
        match columns.row((path, index), values, &mut triples)? {
            Some(row) => rows.push(&row),
            None => deleted += 1,
        }
        Ok(())
    })?;
    let activated = rows.look_activated();
    let mut read = rows.finish(path, origin)?;
    read.gaussians.antialiased = antialiased;
    read.dropped += deleted;
    let deleted = columns.is_edited().then_some(deleted);
    add_notes(&mut read.notes, deleted, activated, odd.extra_bytes);
    Ok(read)
}

/// Adds what the user should know; `deleted` is the number of Gaussians that an editor has deleted, if it was one.
fn add_notes(notes: &mut Vec<String>, deleted: Option<u64>, activated: bool, extra_bytes: u64) {
    if let Some(deleted) = deleted {
        let note = "the selection in the column `state` became label 1";
        let more = if deleted > 0 { format!("; {deleted} deleted Gaussians were left out") } else { String::new() };
        notes.push(format!("{note}{more}"));
    }
    if activated {
        let note = "every opacity is from 0 to 1 and every scale positive: they seem to be written after their sigmoid \
                    and exponential, but a 3DGS PLY has the values before; such a model looks like fog";
        notes.push(note.to_owned());
    }
    if extra_bytes > 0 {
        notes.push(format!("{} bytes after the last Gaussian were ignored", extra_bytes));
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
