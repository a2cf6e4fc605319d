//! Files that pages ask for, written beside the changes of the model.

use super::chosen::Selection;
use super::edits::Work;
use super::message::Export;
use crate::edit::rename::keep;
use crate::edit::select::{MIN_LABEL_CONFIDENCE, extract};
use crate::error::{Error, Result};
use crate::formats::{FirstView, WriteOptions, export_model, formats};
use crate::render::portrait::best_camera;
use crate::scene::Camera;
use crate::words::unique;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Longest name of a file without its ending, bytes.
const NAME_MAX: usize = 100;

/// Writes a part of a model. Returns the file and its number of Gaussians.
pub(super) fn export(
    export: &Export,
    work: &Work,
    chosen: &Selection,
    (first_view, cameras): (Option<FirstView>, &[&Camera]),
) -> Result<(PathBuf, usize)> {
    let model = work.model();
    let part = if export.chosen {
        let rows = chosen.mask();
        model.filtered(|row| rows[row])
    } else if export.labels.is_empty() {
        model.clone()
    } else {
        extract(model, &export.labels, MIN_LABEL_CONFIDENCE)?
    };
    if part.is_empty() {
        let problem = if export.chosen {
            "no Gaussians are selected".to_owned()
        } else {
            format!("have no Gaussian with a confidence of {MIN_LABEL_CONFIDENCE} or more")
        };
        return Err(Error::usage("labels", problem));
    }
    // A part is seen from where it is seen best.
    let best = if part.len() < model.len() { best_camera(&part, cameras) } else { None };
    let first_view = first_view.map(|view| FirstView { eye: best.map_or(view.eye, Camera::centre), ..view });
    let there: BTreeSet<u32> = (0..part.len()).map(|row| part.label(row)).collect();
    let table = work.table().map(|table| keep(table, |id| there.contains(&id)));
    let path = free_path(work.folder(), &export.name, &export.format)?;
    export_model(&path, &part, table.as_ref(), WriteOptions { first_view, ..WriteOptions::default() })?;
    Ok((path, part.len()))
}

/// Returns where a file of a name and ending goes: nothing is written over.
pub(super) fn free_path(folder: &Path, name: &str, ending: &str) -> Result<PathBuf> {
    let is_plain = |letter: char| letter.is_alphanumeric() || " -_.".contains(letter);
    let name = name.trim();
    if name.is_empty() || name.starts_with('.') || name.len() > NAME_MAX || !name.chars().all(is_plain) {
        let problem = format!("use letters, digits, spaces, -, _ and . in a file name, at most {NAME_MAX} bytes");
        return Err(Error::usage("name", problem));
    }
    if !formats().iter().any(|(_, known)| *known == ending) {
        return Err(Error::usage("file", format!("{ending} is not the extension of an output format")));
    }
    let mut taken = BTreeSet::new();
    loop {
        let next = unique(name.to_owned(), " ", &mut taken);
        let path = folder.join(format!("{next}{ending}"));
        if !path.exists() {
            return Ok(path);
        }
    }
}
