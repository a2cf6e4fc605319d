//! The standard 3DGS PLY. Its last column is `label` if the scene has labels. `property float label_confidence`
//! precedes it if votes were counted.

mod columns;
mod decode;
mod joined;
mod packed;
mod stored;
mod write;

pub(super) use joined::joined;
pub use joined::write_joined;

use super::format::{FirstView, ModelFormat, ReadModel};
use crate::ply_table::Table;
use columns::Columns;
use decode::Decoder;
use glam::DVec3;
use labelgs_scene::{Error, Result};
use std::path::Path;

pub use stored::StoredModel;

/// Start of the comment with the world position of the file's (0, 0, 0).
const ORIGIN_COMMENT: &str = "labelgs world_origin ";
/// Starts of the comments with the up direction and the eye position of the initial view, in the world.
const UP_COMMENT: &str = "labelgs up ";
const EYE_COMMENT: &str = "labelgs eye ";
/// Start of the comment that tells viewers (Brush, PlayCanvas) how to draw the model, and its value for antialiased
/// models.
const MODE_COMMENT: &str = "SplatRenderMode: ";
const ANTIALIASED_MODE: &str = "mip";
/// Comment in Postshot's antialiased models.
const POSTSHOT_COMMENT: &str = "antialiased 1";

/// The PLY format of 3DGS viewers.
pub(super) const MODEL_FORMAT: ModelFormat =
    ModelFormat { name: "PLY", extensions: &[".ply"], contents: &["a PLY"], read, write: Some(write::MODEL_WRITER) };

/// Reads a 3DGS PLY: little-endian, big-endian or ascii, with columns in any order and of any scalar type, with or
/// without CloudCompare's prefixes. The number of `f_rest_*` columns (0, 9, 24, 45 or 72, channel-major) gives the SH
/// degree, of which at most 3 is kept.
///
/// Applies the filter of Mip-Splatting, and gives 2DGS discs a thin third axis. Other columns that may change renders
/// get a note. `label` is optional; without it, Gaussians selected in an editor (column `state`) get label 1. A label
/// of -1 is read as 0; one that is not a whole number up to [`MODEL_LABEL_MAX`] is an error. Rows that cannot be
/// rendered are dropped and counted. Compressed PLY files are read too.
///
/// [`MODEL_LABEL_MAX`]: labelgs_scene::MODEL_LABEL_MAX
fn read(path: &Path) -> Result<ReadModel> {
    let table = Table::open(path)?;
    if packed::is_packed(&table) {
        return packed::read(path, table);
    }
    let columns = Columns::find(path, &table)?;
    let (origin, antialiased) = (origin(path, &table)?, is_antialiased(table.comments()));
    let first_view = first_view(&table);
    let (mut rows, mut decoder) = (columns.rows(), Decoder::new(path, &columns));
    let extra_bytes = table.for_each(&columns.names(), |index, values| {
        if let Some(row) = decoder.row(index, values)? {
            rows.push(&row);
        }
        Ok(())
    })?;
    let activated = rows.sieve.looks_activated();
    let mut read = rows.finish(path, origin)?;
    read.gaussians.antialiased = antialiased;
    read.dropped += decoder.deleted;
    read.notes.extend(decoder.notes());
    add_notes(&mut read.notes, activated, extra_bytes);
    Ok(ReadModel { first_view, ..read })
}

/// Adds notes about the values and the length of a file.
fn add_notes(notes: &mut Vec<String>, activated: bool, extra_bytes: u64) {
    if activated {
        let note = "every opacity is from 0 to 1 and every scale positive: they seem to be written after their sigmoid \
                    and exponential, but a 3DGS PLY has the values before; such a model looks like fog";
        notes.push(note.to_owned());
    }
    if extra_bytes > 0 {
        notes.push(format!("{} bytes after the last Gaussian were ignored", extra_bytes));
    }
}

/// Returns true if the comments of a header mark the model as antialiased.
fn is_antialiased<'a>(mut comments: impl Iterator<Item = &'a str>) -> bool {
    comments.any(|comment| {
        let comment = comment.trim();
        comment.strip_prefix(MODE_COMMENT).is_some_and(|mode| mode.trim() == ANTIALIASED_MODE)
            || comment == POSTSHOT_COMMENT
    })
}

/// Returns the origin from the header's comments.
fn origin(path: &Path, table: &Table) -> Result<Option<DVec3>> {
    let Some(words) = comment(table, ORIGIN_COMMENT) else { return Ok(None) };
    match triple(words) {
        Some(place) if place.as_vec3().is_finite() => Ok(Some(place)),
        _ => {
            let problem =
                format!("the comment `{ORIGIN_COMMENT}{words}` does not end with three numbers; correct or remove it");
            Err(Error::data(path, "header", problem))
        }
    }
}

/// Returns the initial view from the header's comments. It is only a hint, so a damaged one is ignored.
fn first_view(table: &Table) -> Option<FirstView> {
    let of = |start| comment(table, start).and_then(triple);
    FirstView::checked(of(UP_COMMENT)?, of(EYE_COMMENT)?)
}

/// Returns the rest of a header comment that begins with `start`.
fn comment<'a>(table: &'a Table, start: &str) -> Option<&'a str> {
    table.comments().find_map(|comment| comment.trim().strip_prefix(start))
}

/// Parses three numbers.
fn triple(words: &str) -> Option<DVec3> {
    let numbers: Option<Vec<f64>> = words.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok().map(DVec3::from_array)
}
