//! Changes of the labels of a working copy, each with its command and its inverse.

use super::Words;
use super::message::Edit;
use crate::edit::catalogue::Catalogue;
use crate::edit::change::recolour;
use crate::edit::merge::{Merged, merge};
use crate::edit::rename::keep;
use crate::edit::select::{MIN_LABEL_CONFIDENCE, extract, remove};
use crate::error::{Error, Result};
use crate::files::label_table::LabelTable;
use crate::files::{read, run_folder};
use crate::formats::{WriteOptions, export_model};
use crate::scene::Gaussians;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most changes that can be taken back.
const UNDO_MAX: usize = 100;

/// A model, its names, and the changes so far.
pub(super) struct Work<'a> {
    /// The model as it was typed: the input of the first command.
    typed: &'a Path,
    words: &'a dyn Words,
    pub(super) model: Gaussians,
    pub(super) table: Option<LabelTable>,
    done: Vec<Done>,
    /// Changes that can no longer be taken back.
    settled: Vec<(String, PathBuf)>,
    folder: PathBuf,
    /// Number of the next file.
    next: u32,
    /// Output of the last change that was written.
    written: Option<PathBuf>,
}

/// A change that can be taken back.
struct Done {
    command: String,
    output: PathBuf,
    table: Option<LabelTable>,
    before: Before,
}

/// What a change replaced.
enum Before {
    Labels(Option<Vec<u32>>),
    /// Colours of some rows.
    Colours {
        rows: Vec<usize>,
        sh0: Vec<[f32; 3]>,
        sh_rest: Vec<[f32; 3]>,
    },
    /// Rows that are gone, with their places.
    Rows {
        rows: Vec<usize>,
        removed: Gaussians,
    },
}

impl<'a> Work<'a> {
    /// Starts with a model. Files go to the folder `edits` of its run, or to one beside it.
    pub(super) fn new(typed: &'a Path, model: Gaussians, table: Option<LabelTable>, words: &'a dyn Words) -> Self {
        let stem = typed.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = match run_folder::of_model(typed) {
            Some(_) if typed.is_dir() => typed.join("edits"),
            Some(run) => run.join("edits"),
            None => typed.with_file_name(format!("{stem}-edits")),
        };
        // Names of earlier sessions are not used again. An unreadable folder shows when it is written to.
        let names = if folder.is_dir() { read::folder(&folder).unwrap_or_default() } else { Vec::new() };
        let last = names.iter().filter_map(|path| path.file_name()?.to_str()?.split('.').next()?.parse::<u32>().ok());
        let next = last.max().map_or(1, |last| last.saturating_add(1));
        let (done, settled) = (Vec::new(), Vec::new());
        Self { typed, words, model, table, done, settled, folder, next, written: None }
    }

    /// Returns true if the model differs from the file.
    pub(super) fn is_changed(&self) -> bool {
        !self.done.is_empty() || !self.settled.is_empty()
    }

    /// The file that the model as it is now has or would have.
    fn present(&self) -> &Path {
        let settled = || self.settled.last().map(|(_, output)| output.as_path());
        self.done.last().map(|done| done.output.as_path()).or_else(settled).unwrap_or(self.typed)
    }

    fn known(&self) -> Catalogue {
        Catalogue::new(&self.model, self.table.clone())
    }

    /// Changes the model, or writes a part of it. Returns a sentence for the page.
    pub(super) fn apply(&mut self, edit: &Edit) -> Result<String> {
        if let Some(problem) = edit.problem() {
            return Err(Error::usage("edit", problem));
        }
        let output = self.folder.join(format!("{:03}.ply", self.next));
        let command = self.words.edit(edit, self.present(), &output);
        let (known, before, table) = (self.known(), self.table.clone(), self.table.as_ref());
        let labels: BTreeSet<u32> = labels_of(edit).iter().copied().collect();
        known.check("labels", &labels)?;
        let listed: Vec<u32> = labels.iter().copied().collect();
        let before_model = match edit {
            Edit::Export { .. } => {
                let part = extract(&self.model, &listed, MIN_LABEL_CONFIDENCE)?;
                if part.is_empty() {
                    return Err(Error::usage(
                        "labels",
                        format!("have no Gaussian of a confidence of {MIN_LABEL_CONFIDENCE}"),
                    ));
                }
                let names = table.map(|table| keep(table, |id| labels.contains(&id)));
                export_model(&output, &part, names.as_ref(), WriteOptions::default())?;
                self.next += 1;
                return Ok(format!("{} Gaussians are in {}. The command was: {command}", part.len(), output.display()));
            }
            Edit::Rename { .. } | Edit::Merge { .. } => {
                let name = if let Edit::Rename { name, .. } = edit { Some(name.as_str()) } else { None };
                let Merged { model, table, .. } = merge(&self.model, &known, &labels, None, name)?;
                self.table = table;
                let old = std::mem::replace(&mut self.model, model);
                Before::Labels(old.labels)
            }
            Edit::Recolour { colour, mix, .. } => {
                let model = recolour(&self.model, &labels, *colour, *mix);
                colours(&std::mem::replace(&mut self.model, model), &labels)
            }
            Edit::Remove { .. } => {
                let rest = remove(&self.model, &listed)?;
                self.table = table.map(|table| keep(table, |id| !labels.contains(&id)));
                let old = std::mem::replace(&mut self.model, rest);
                let rows: Vec<usize> = rows_of(&old, &labels);
                let gone: BTreeSet<usize> = rows.iter().copied().collect();
                Before::Rows { removed: old.filtered(|row| gone.contains(&row)), rows }
            }
        };
        self.next += 1;
        self.done.push(Done { command, output, table: before, before: before_model });
        if self.done.len() > UNDO_MAX {
            let Done { command, output, .. } = self.done.remove(0);
            self.settled.push((command, output));
        }
        Ok(String::new())
    }

    /// Takes back the last change.
    pub(super) fn undo(&mut self) -> Result<String> {
        let none = || Error::usage("undo", "there is no change to take back");
        let Done { table, before, .. } = self.done.pop().ok_or_else(none)?;
        self.table = table;
        match before {
            Before::Labels(labels) => self.model.labels = labels,
            Before::Colours { rows, sh0, sh_rest } => {
                let rest = self.model.rest_per_gaussian();
                for (index, &row) in rows.iter().enumerate() {
                    self.model.sh0[row] = sh0[index];
                    let old = &sh_rest[index * rest..(index + 1) * rest];
                    self.model.sh_rest[row * rest..(row + 1) * rest].copy_from_slice(old);
                }
            }
            Before::Rows { rows, removed } => self.model = interleaved(&self.model, &removed, &rows),
        }
        Ok(String::new())
    }

    /// Writes the model as it is now. Returns a sentence for the page.
    pub(super) fn write(&mut self) -> Result<String> {
        if !self.is_changed() {
            return Err(Error::usage("write", "nothing has changed; the model is in its file"));
        }
        let path = self.present().to_owned();
        export_model(&path, &self.model, self.table.as_ref(), WriteOptions::default())?;
        let text = format!("Saved as {}.", path.display());
        self.written = Some(path);
        Ok(text)
    }

    fn is_saved(&self) -> bool {
        self.written.as_deref() == Some(self.present()) || !self.is_changed()
    }

    /// Writes changes that are in no file yet, and returns their file; `None` without any.
    pub(super) fn save(&mut self) -> Result<Option<PathBuf>> {
        if self.is_saved() {
            return Ok(None);
        }
        self.write()?;
        Ok(self.written.clone())
    }

    /// Returns the changes for a page.
    pub(super) fn describe(&self) -> Value {
        let settled = self.settled.iter().map(|(command, _)| command);
        let commands: Vec<_> = settled.chain(self.done.iter().map(|done| &done.command)).collect();
        json!({
            "kind": "edits",
            "commands": commands,
            "undo": !self.done.is_empty(),
            "saved": self.is_saved(),
            "file": self.present().display().to_string(),
        })
    }
}

fn labels_of(edit: &Edit) -> &[u32] {
    match edit {
        Edit::Rename { label, .. } => std::slice::from_ref(label),
        Edit::Merge { labels } | Edit::Recolour { labels, .. } | Edit::Remove { labels } | Edit::Export { labels } => {
            labels
        }
    }
}

fn rows_of(model: &Gaussians, labels: &BTreeSet<u32>) -> Vec<usize> {
    let has = |row: &usize| labels.contains(&model.label(*row));
    (0..model.len()).filter(has).collect()
}

fn colours(model: &Gaussians, labels: &BTreeSet<u32>) -> Before {
    let (rows, rest) = (rows_of(model, labels), model.rest_per_gaussian());
    let sh0 = rows.iter().map(|&row| model.sh0[row]).collect();
    let sh_rest = rows.iter().flat_map(|&row| model.sh_rest[row * rest..(row + 1) * rest].iter().copied()).collect();
    Before::Colours { rows, sh0, sh_rest }
}

/// Puts removed rows back in their places.
fn interleaved(kept: &Gaussians, removed: &Gaussians, rows: &[usize]) -> Gaussians {
    let total = kept.len() + removed.len();
    let mut sources = Vec::with_capacity(total);
    let (mut next, mut left) = (0, 0);
    for row in 0..total {
        if rows.get(next) == Some(&row) {
            sources.push((removed, next));
            next += 1;
        } else {
            sources.push((kept, left));
            left += 1;
        }
    }
    let rest = kept.rest_per_gaussian();
    let column = |of: fn(&Gaussians) -> Option<&Vec<u32>>| -> Option<Vec<u32>> {
        sources.iter().map(|&(from, at)| of(from).map(|values| values[at])).collect()
    };
    let shares: Option<Vec<f32>> =
        sources.iter().map(|&(from, at)| from.label_confidence.as_ref().map(|values| values[at])).collect();
    Gaussians {
        origin: kept.origin,
        means: sources.iter().map(|&(from, at)| from.means[at]).collect(),
        quats: sources.iter().map(|&(from, at)| from.quats[at]).collect(),
        scales: sources.iter().map(|&(from, at)| from.scales[at]).collect(),
        opacities: sources.iter().map(|&(from, at)| from.opacities[at]).collect(),
        sh0: sources.iter().map(|&(from, at)| from.sh0[at]).collect(),
        sh_rest: sources
            .iter()
            .flat_map(|&(from, at)| from.sh_rest[at * rest..(at + 1) * rest].iter().copied())
            .collect(),
        sh_degree: kept.sh_degree,
        antialiased: kept.antialiased,
        labels: column(|model| model.labels.as_ref()),
        label_confidence: shares,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Plain;
    impl Words for Plain {
        fn edit(&self, edit: &Edit, input: &Path, output: &Path) -> String {
            format!("{edit:?} {} {}", input.display(), output.display())
        }
        fn view(&self, model: &Path) -> String {
            model.display().to_string()
        }
    }

    fn model() -> Gaussians {
        let count = 12;
        Gaussians {
            means: (0..count).map(|row| [row as f32; 3]).collect(),
            quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
            scales: vec![[-3.0; 3]; count],
            opacities: (0..count).map(|row| row as f32).collect(),
            sh0: (0..count).map(|row| [0.1 * row as f32; 3]).collect(),
            sh_rest: (0..count * 3).map(|row| [0.01 * row as f32; 3]).collect(),
            sh_degree: 1,
            labels: Some((0..count as u32).map(|row| row % 4).collect()),
            label_confidence: Some(vec![0.9; count]),
            ..Gaussians::default()
        }
    }

    #[test]
    fn every_change_can_be_taken_back() {
        let edits = [
            Edit::Rename { label: 1, name: "cup".into() },
            Edit::Merge { labels: vec![1, 2] },
            Edit::Recolour { labels: vec![3], colour: [1.0, 0.0, 0.0], mix: 0.7 },
            Edit::Remove { labels: vec![3, 0] },
            Edit::Rename { label: 1, name: "set".into() },
        ];
        let mut work = Work::new(Path::new("a/m.ply"), model(), None, &Plain);
        let mut states = Vec::new();
        for edit in &edits {
            states.push((work.model.clone(), work.table.clone(), work.present().to_owned()));
            work.apply(edit).expect("a change");
        }
        assert_eq!(work.present(), Path::new("a/m-edits/005.ply"));
        while let Some((model, table, path)) = states.pop() {
            work.undo().expect("undo");
            assert_eq!((&work.model, &work.table, work.present()), (&model, &table, &*path));
        }
        assert!(work.undo().is_err() && work.write().is_err() && !work.is_changed());
        work.apply(&edits[0]).expect("a change");
        assert_eq!(work.present(), Path::new("a/m-edits/006.ply"), "a name is not used again");
    }

    #[test]
    fn bad_changes_change_nothing() {
        let mut work = Work::new(Path::new("m.ply"), model(), None, &Plain);
        for edit in [
            Edit::Rename { label: 9, name: "x".into() },
            Edit::Rename { label: 1, name: " ".into() },
            Edit::Rename { label: 1, name: "a\nb".into() },
            Edit::Merge { labels: vec![1] },
            Edit::Remove { labels: vec![0, 1, 2, 3] },
            Edit::Remove { labels: vec![] },
            Edit::Recolour { labels: vec![1], colour: [f32::NAN, 0.0, 0.0], mix: 1.0 },
        ] {
            assert!(work.apply(&edit).is_err(), "{edit:?}");
            assert_eq!(work.model, model());
            assert!(!work.is_changed());
        }
    }
}
