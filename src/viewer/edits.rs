//! Changes of a working copy. The list of them is written after each one, so that none is lost; the model when a page
//! asks for it, and at the end.

use super::ProgramCommands;
use crate::edit::{Document, Edit, EditsFile, Sights};
use crate::error::{Error, Result};
use crate::files::label_table::LabelTable;
use crate::files::{read, run_folder};
use crate::formats::{FirstView, WriteOptions, export_model};
use crate::scene::Gaussians;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A model, its names, and the changes so far.
pub(super) struct Work<'a> {
    /// The model as it was typed: the input of the command.
    typed: PathBuf,
    words: &'a dyn ProgramCommands,
    now: Document,
    /// Before the first change; none without changes.
    first: Option<Document>,
    done: Vec<AppliedEdit>,
    /// Changes that were undone, the last one first.
    undone: Vec<Edit>,
    folder: PathBuf,
    /// The model that the changes make, once there are some, and whether it is written.
    output: Option<(PathBuf, bool)>,
    /// Number of edits, undone or not, and number of edits that changed the rows.
    version: u64,
    rows_version: u64,
    /// Why the list of changes is not on the disk, if it is not.
    problem: Option<Error>,
    /// Where the model is seen from at first, as files of it say.
    first_view: Option<FirstView>,
}

/// A change.
struct AppliedEdit {
    edit: Edit,
    told: String,
    /// The resulting model, if the edit took long.
    after: Option<Document>,
}

impl<'a> Work<'a> {
    /// Starts with a model. Files go to the folder `edits` of its run, or to one beside it.
    pub(super) fn new(
        typed: &Path,
        model: Gaussians,
        table: Option<LabelTable>,
        words: &'a dyn ProgramCommands,
    ) -> Self {
        let stem = typed.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = match run_folder::find_for_model(typed) {
            Some(_) if typed.is_dir() => typed.join("edits"),
            Some(run) => run.join("edits"),
            None => typed.with_file_name(format!("{stem}-edits")),
        };
        let now = Document { model, table };
        Self {
            typed: typed.to_owned(),
            words,
            now,
            first: None,
            done: Vec::new(),
            undone: Vec::new(),
            folder,
            output: None,
            version: 0,
            rows_version: 0,
            problem: None,
            first_view: None,
        }
    }

    /// Starts again with another model.
    pub(super) fn reopened(&self, typed: &Path, model: Gaussians, table: Option<LabelTable>) -> Self {
        Self {
            version: self.version + 1,
            rows_version: self.rows_version + 1,
            ..Self::new(typed, model, table, self.words)
        }
    }

    /// Returns the work on a model that is seen from somewhere at first.
    pub(super) fn seen_from(self, first_view: Option<FirstView>) -> Self {
        Self { first_view, ..self }
    }

    pub(super) fn model(&self) -> &Gaussians {
        &self.now.model
    }

    pub(super) fn table(&self) -> Option<&LabelTable> {
        self.now.table.as_ref()
    }

    /// The folder of what is written.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns true if the model differs from the file.
    pub(super) fn is_changed(&self) -> bool {
        !self.done.is_empty()
    }

    /// Returns a number that identifies this state.
    pub(super) fn version(&self) -> u64 {
        self.version
    }

    /// Returns a number that identifies the rows of the model.
    pub(super) fn rows_version(&self) -> u64 {
        self.rows_version
    }

    /// Changes the model.
    pub(super) fn apply(&mut self, edit: Edit, sights: &mut Sights) -> Result<()> {
        self.make(edit, sights)?;
        self.undone.clear();
        self.note();
        Ok(())
    }

    /// Takes the last change back.
    pub(super) fn undo(&mut self) -> Result<()> {
        let none = || Error::usage("undo", "there is no edit to undo");
        let last = self.done.pop().ok_or_else(none)?;
        let kept = self.done.iter().enumerate().rev().find_map(|(at, done)| Some((at + 1, done.after.clone()?)));
        let (from, mut now) = match kept {
            Some((at, after)) => (at, after),
            None if self.done.is_empty() => (0, self.first.take().ok_or_else(none)?),
            None => (0, self.first.clone().ok_or_else(none)?),
        };
        // Results of edits that need images were kept.
        let mut sights = |_: &Gaussians| Err(Error::Bug("a filled model was not kept".to_owned()));
        for done in &self.done[from..] {
            now = now.apply(&done.edit, &mut sights)?;
        }
        self.now = now;
        self.version += 1;
        self.rows_version += u64::from(last.edit.changes_rows());
        self.undone.push(last.edit);
        self.note();
        Ok(())
    }

    /// Repeats the change that was undone last.
    pub(super) fn redo(&mut self, sights: &mut Sights) -> Result<()> {
        let none = || Error::usage("redo", "there is no edit to redo");
        let edit = self.undone.last().cloned().ok_or_else(none)?;
        self.make(edit, sights)?;
        self.undone.pop();
        self.note();
        Ok(())
    }

    fn make(&mut self, edit: Edit, sights: &mut Sights) -> Result<()> {
        let after = self.now.apply(&edit, sights)?;
        let told = self.now.told(&edit);
        let before = std::mem::replace(&mut self.now, after);
        self.first.get_or_insert(before);
        self.version += 1;
        self.rows_version += u64::from(edit.changes_rows());
        let is_slow = matches!(edit, Edit::Remove { fill: true, .. });
        self.done.push(AppliedEdit { edit, told, after: is_slow.then(|| self.now.clone()) });
        Ok(())
    }

    /// Writes the list of changes beside the model that they make. A written model is not written again.
    fn note(&mut self) {
        let output = match self.output.take() {
            Some((path, false)) => path,
            _ => self.folder.join(format!("{:03}.ply", self.next_number())),
        };
        self.output = Some((output.clone(), false));
        self.problem = self.list().write(&list_of(&output)).err();
    }

    /// Returns once why the list of changes could not be written.
    pub(super) fn take_problem(&mut self) -> Option<String> {
        self.problem.take().map(|error| format!("{error}. The edits are in memory only"))
    }

    fn list(&self) -> EditsFile {
        let edits = self.done.iter().map(|done| done.edit.clone()).collect();
        EditsFile::new(&self.first.as_ref().unwrap_or(&self.now).model, edits)
    }

    /// Returns the first number after all files in the folder. An unreadable folder causes an error on writing.
    fn next_number(&self) -> u32 {
        let names = if self.folder.is_dir() { read::folder(&self.folder).unwrap_or_default() } else { Vec::new() };
        let numbers =
            names.iter().filter_map(|path| path.file_name()?.to_str()?.split('.').next()?.parse::<u32>().ok());
        numbers.max().map_or(1, |last| last.saturating_add(1))
    }

    /// Writes the model as it is now, and the list of changes, in case it could not be written before. Returns a
    /// sentence for the page.
    pub(super) fn write(&mut self) -> Result<String> {
        let none = || Error::usage("save", "there are no unsaved edits");
        let (path, _) = self.output.clone().filter(|_| self.is_changed()).ok_or_else(none)?;
        // As the command line writes it, so that a replay has the same bytes.
        let options = WriteOptions { first_view: self.first_view, ..WriteOptions::default() };
        export_model(&path, &self.now.model, self.now.table.as_ref(), options)?;
        self.list().write(&list_of(&path))?;
        let text = format!("Saved as {}.", path.display());
        self.output = Some((path, true));
        Ok(text)
    }

    fn is_saved(&self) -> bool {
        !self.is_changed() || self.output.as_ref().is_some_and(|(_, is_written)| *is_written)
    }

    /// Writes changes that are in no file yet, and returns their file; `None` without any.
    pub(super) fn save(&mut self) -> Result<Option<PathBuf>> {
        if self.is_saved() {
            return Ok(None);
        }
        self.write()?;
        Ok(self.output.as_ref().map(|(path, _)| path.clone()))
    }

    pub(super) fn describe(&self) -> Value {
        let output = self.output.as_ref().filter(|_| self.is_changed()).map(|(path, _)| path.as_path());
        json!({
            "kind": "edits",
            "changes": self.done.iter().map(|done| &done.told).collect::<Vec<_>>(),
            "redo": self.undone.len(),
            "saved": self.is_saved(),
            "file": output.map(|path| path.display().to_string()),
            "command": output.map(|path| self.words.replay(&self.typed, &list_of(path), path)),
        })
    }
}

/// The list of changes beside a model.
fn list_of(model: &Path) -> PathBuf {
    model.with_extension("edits.json")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::Rows;

    struct Plain;
    impl ProgramCommands for Plain {
        fn replay(&self, model: &Path, edits: &Path, output: &Path) -> String {
            format!("{} {} {}", model.display(), edits.display(), output.display())
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

    fn no_sights(_: &Gaussians) -> Result<Vec<crate::edit::fill::Sight>> {
        panic!("nothing is filled")
    }

    #[test]
    fn every_change_can_be_taken_back_and_made_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("m.ply");
        let half: Vec<bool> = (0..12).map(|row| row < 6).collect();
        let edits = [
            Edit::Rename { label: 1, name: "cup".into() },
            Edit::Merge { labels: vec![1, 2] },
            Edit::Assign { rows: Rows::from_mask(&half), label: None, name: None },
            Edit::Remove { labels: vec![3, 0], fill: false },
            Edit::Rename { label: 1, name: "set".into() },
        ];
        let mut work = Work::new(&path, model(), None, &Plain);
        let mut states = vec![work.now.clone()];
        for edit in &edits {
            work.apply(edit.clone(), &mut no_sights).expect("a change");
            states.push(work.now.clone());
        }
        for state in states[..5].iter().rev() {
            work.undo().expect("undo");
            assert_eq!(&work.now, state);
        }
        assert!(work.undo().is_err() && work.write().is_err() && !work.is_changed());
        for state in &states[1..] {
            work.redo(&mut no_sights).expect("redo");
            assert_eq!(&work.now, state);
        }
        assert!(work.redo(&mut no_sights).is_err());
        assert_eq!(work.rows_version(), 3, "one removal, back, and again");
        work.undo().expect("undo");
        work.apply(edits[0].clone(), &mut no_sights).expect("a change");
        assert!(work.redo(&mut no_sights).is_err(), "a new change ends what could be made again");

        // The list is there after each change; the model when it was asked for, and then a new pair begins.
        let list = folder.path().join("m-edits/001.edits.json");
        let first = Document { model: model(), table: None };
        let replayed = EditsFile::read(&list).expect("a list").replay(&list, first, &mut no_sights).expect("a model");
        assert_eq!(replayed, work.now);
        assert!(!list.with_file_name("001.ply").exists());
        work.write().expect("a file");
        assert!(list.with_file_name("001.ply").exists() && work.save().expect("saved").is_none());
        work.undo().expect("undo");
        assert_eq!(work.save().expect("saved"), Some(list.with_file_name("002.ply")));
    }

    #[test]
    fn bad_changes_change_nothing() {
        let mut work = Work::new(Path::new("m.ply"), model(), None, &Plain);
        for edit in
            [Edit::Rename { label: 9, name: "x".into() }, Edit::Remove { labels: vec![0, 1, 2, 3], fill: false }]
        {
            assert!(work.apply(edit.clone(), &mut no_sights).is_err(), "{edit:?}");
            assert!(work.model() == &model() && !work.is_changed());
        }
    }
}
