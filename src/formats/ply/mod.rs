//! The standard 3DGS PLY. If the scene has labels, the last column is `label`. If votes were counted, `property float
//! label_confidence` precedes it.

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
const ORIGIN: &str = "labelgs world_origin ";
/// Starts of the comments with the way up, and with the place of the eye at first, in the world.
const UP: &str = "labelgs up ";
const EYE: &str = "labelgs eye ";
/// Start of the comment with how viewers draw the model (Brush, PlayCanvas), and its value for antialiased models.
const MODE: &str = "SplatRenderMode: ";
const ANTIALIASED: &str = "mip";
/// The comment of Postshot's antialiased models.
const ANTIALIASED_POSTSHOT: &str = "antialiased 1";

/// The format that viewers of 3DGS read.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "PLY", endings: &[".ply"], contents: &["a PLY"], read, write: Some(write::WRITER) };

/// Reads a 3DGS PLY: little-endian, big-endian or ascii, columns by name in any order and of any scalar type, with or
/// without the prefixes of CloudCompare. The number of `f_rest_*` (0, 9, 24, 45 or 72, channel-major) gives the SH degree, of
/// which 3 are kept; `label` is optional. The filter of Mip-Splatting is applied, discs of 2DGS get a thin third axis; other
/// columns that may change the picture are named in a note. Without `label`, the selection in the `state` of an editor is
/// label 1. Rows that cannot be rendered are dropped and counted. A compressed PLY is read too. A label of -1 is none; one
/// that is no whole number up to [`MODEL_LABEL_MAX`] is an error.
///
/// [`MODEL_LABEL_MAX`]: labelgs_scene::MODEL_LABEL_MAX
fn read(path: &Path) -> Result<ReadModel> {
    let table = Table::open(path)?;
    if packed::is_packed(&table) {
        return packed::read(path, table);
    }
    let columns = Columns::of(path, &table)?;
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

/// Adds what the user should know of the values and the length of a file.
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

/// Returns true if the comments of a header say that the model is antialiased.
fn is_antialiased<'a>(mut comments: impl Iterator<Item = &'a str>) -> bool {
    comments.any(|comment| {
        let comment = comment.trim();
        comment.strip_prefix(MODE).is_some_and(|mode| mode.trim() == ANTIALIASED) || comment == ANTIALIASED_POSTSHOT
    })
}

/// Returns the origin in the comments of the header.
fn origin(path: &Path, table: &Table) -> Result<Option<DVec3>> {
    let Some(words) = comment(table, ORIGIN) else { return Ok(None) };
    match triple(words) {
        Some(place) if place.as_vec3().is_finite() => Ok(Some(place)),
        _ => {
            let problem =
                format!("the comment `{ORIGIN}{words}` does not end with three numbers; correct or remove it");
            Err(Error::data(path, "header", problem))
        }
    }
}

/// Returns where to see the model from at first, if the comments of the header say it. It is a hint, so a damaged one does not matter.
fn first_view(table: &Table) -> Option<FirstView> {
    let of = |start| comment(table, start).and_then(triple);
    FirstView::checked(of(UP)?, of(EYE)?)
}

/// Returns the rest of a comment of the header by its start.
fn comment<'a>(table: &'a Table, start: &str) -> Option<&'a str> {
    table.comments().find_map(|comment| comment.trim().strip_prefix(start))
}

/// Returns three numbers, if the words are that.
fn triple(words: &str) -> Option<DVec3> {
    let numbers: Option<Vec<f64>> = words.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok().map(DVec3::from_array)
}
