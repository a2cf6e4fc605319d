//! Changes of the labels of a working copy, each with its command. A change is taken back by the others, from the first model on.

use super::Words;
use super::message::Edit;
use crate::edit::add::add;
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

/// A model, its names, and the changes so far.
pub(super) struct Work<'a> {
    /// The model as it was typed: the input of the first command.
    typed: &'a Path,
    words: &'a dyn Words,
    pub(super) model: Gaussians,
    pub(super) table: Option<LabelTable>,
    /// Model and names before the first change; none without changes.
    first: Option<(Gaussians, Option<LabelTable>)>,
    done: Vec<Done>,
    folder: PathBuf,
    /// Number of the next file.
    next: u32,
    /// Output of the last change that was written.
    written: Option<PathBuf>,
}

/// A change.
struct Done {
    edit: Edit,
    command: String,
    output: PathBuf,
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
        Self { typed, words, model, table, first: None, done: Vec::new(), folder, next, written: None }
    }

    /// Returns true if the model differs from the file.
    pub(super) fn is_changed(&self) -> bool {
        !self.done.is_empty()
    }

    /// Returns what tells models of other Gaussians apart: the file of the last change of their number.
    pub(super) fn rows_of(&self) -> &Path {
        let removed = self.done.iter().rev().find(|done| matches!(done.edit, Edit::Remove { .. }));
        removed.map_or(self.typed, |done| &done.output)
    }

    /// The file that the model as it is now has or would have.
    fn present(&self) -> &Path {
        self.done.last().map_or(self.typed, |done| &done.output)
    }

    /// Changes the model, or writes a part of it. Returns a sentence for the page.
    pub(super) fn apply(&mut self, edit: &Edit) -> Result<String> {
        if let Some(problem) = edit.problem() {
            return Err(Error::usage("edit", problem));
        }
        let output = self.folder.join(format!("{:03}.ply", self.next));
        let command = self.words.edit(edit, self.present(), &output);
        if !matches!(edit, Edit::Label { .. }) {
            Catalogue::new(&self.model, self.table.clone()).check("labels", &labels_of(edit))?;
        }
        let (model, table) = changed(&self.model, self.table.as_ref(), edit)?;
        if let Edit::Export { .. } = edit {
            if model.is_empty() {
                let problem = format!("have no Gaussian of a confidence of {MIN_LABEL_CONFIDENCE}");
                return Err(Error::usage("labels", problem));
            }
            export_model(&output, &model, table.as_ref(), WriteOptions::default())?;
            self.next += 1;
            return Ok(format!("{} Gaussians are in {}. The command was: {command}", model.len(), output.display()));
        }
        let before = (std::mem::replace(&mut self.model, model), std::mem::replace(&mut self.table, table));
        self.first.get_or_insert(before);
        self.next += 1;
        self.done.push(Done { edit: edit.clone(), command, output });
        Ok(String::new())
    }

    pub(super) fn undo(&mut self) -> Result<()> {
        let none = || Error::usage("undo", "there is no change to take back");
        self.done.pop().ok_or_else(none)?;
        let first = if self.done.is_empty() { self.first.take() } else { self.first.clone() };
        let (mut model, mut table) = first.ok_or_else(none)?;
        for done in &self.done {
            (model, table) = changed(&model, table.as_ref(), &done.edit)?;
        }
        (self.model, self.table) = (model, table);
        Ok(())
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

    pub(super) fn describe(&self) -> Value {
        json!({
            "kind": "edits",
            "commands": self.done.iter().map(|done| &done.command).collect::<Vec<_>>(),
            "undo": self.is_changed(),
            "saved": self.is_saved(),
            "file": self.present().display().to_string(),
        })
    }
}

fn labels_of(edit: &Edit) -> BTreeSet<u32> {
    match edit {
        Edit::Rename { label, .. } => BTreeSet::from([*label]),
        Edit::Label { .. } => BTreeSet::new(),
        Edit::Merge { labels } | Edit::Recolour { labels, .. } | Edit::Remove { labels } | Edit::Export { labels } => {
            labels.iter().copied().collect()
        }
    }
}

/// Returns what an edit makes of a model and its names.
fn changed(model: &Gaussians, table: Option<&LabelTable>, edit: &Edit) -> Result<(Gaussians, Option<LabelTable>)> {
    let labels = labels_of(edit);
    let listed: Vec<u32> = labels.iter().copied().collect();
    let merged = |name: Option<&str>| {
        let known = Catalogue::new(model, table.cloned());
        merge(model, &known, &labels, None, name).map(|Merged { model, table, .. }| (model, table))
    };
    match edit {
        Edit::Rename { name, .. } => merged(Some(name)),
        Edit::Merge { .. } => merged(None),
        Edit::Label { rows, name, .. } => {
            add(model, table.cloned(), rows, name.as_deref()).map(|Merged { model, table, .. }| (model, table))
        }
        Edit::Recolour { colour, mix, .. } => Ok((recolour(model, &labels, *colour, *mix), table.cloned())),
        Edit::Remove { .. } => {
            Ok((remove(model, &listed)?, table.map(|table| keep(table, |id| !labels.contains(&id)))))
        }
        Edit::Export { .. } => {
            let part = extract(model, &listed, MIN_LABEL_CONFIDENCE)?;
            Ok((part, table.map(|table| keep(table, |id| labels.contains(&id)))))
        }
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
