//! A model that stays in its file: its rows are seen one after the other, and some of them are read when they are asked for.

use super::columns::Columns;
use super::decode::Decoder;
use super::{add_notes, is_antialiased, origin, packed};
use crate::ply_table::Table;
use crate::rows::{Row, Sieve};
use glam::DVec3;
use labelgs_scene::{Error, Gaussians, Result};
use std::path::{Path, PathBuf};

/// A 3DGS PLY whose rows have fixed places.
#[derive(Clone, Debug)]
pub struct StoredModel {
    path: PathBuf,
    columns: Columns,
    count: u64,
    /// World position of the file's (0, 0, 0).
    origin: DVec3,
    notes: Vec<String>,
    antialiased: bool,
}

impl StoredModel {
    /// Opens a file; `None` for one that is read whole: of text, compressed, changed by an editor, or with positions of
    /// another type.
    pub fn open(path: &Path) -> Result<Option<Self>> {
        // A pipe is read once.
        if !path.is_file() || packed::is_packed(path)? {
            return Ok(None);
        }
        let table = Table::open(path)?;
        let columns = Columns::of(path, &table)?;
        if columns.edited || !["x", "y", "z"].iter().all(|name| table.is_single(name)) {
            return Ok(None);
        }
        let (count, antialiased, mut notes) = (table.count(), is_antialiased(table.comments()), Vec::new());
        let origin = match origin(path, &table)? {
            Some(origin) => origin,
            None => crate::origin::read(path, count, &mut notes)?,
        };
        let has_places = table.places_of_rows(&columns.names())?.is_some();
        Ok(has_places.then(|| Self { path: path.to_owned(), columns, count, origin, notes, antialiased }))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of rows, those included that cannot be rendered.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Degree of the spherical harmonics.
    pub fn sh_degree(&self) -> u32 {
        self.columns.sh_degree
    }

    /// Returns true if rows have labels.
    pub fn has_labels(&self) -> bool {
        self.columns.have_labels()
    }

    /// World position of the file's (0, 0, 0).
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Calls `see` with the number and the values of each row that can be rendered, in order. Returns notes for the user.
    pub fn scan(&self, mut see: impl FnMut(u64, &Row) -> Result<()>) -> Result<Vec<String>> {
        let (path, columns) = (&self.path, &self.columns);
        let (mut decoder, mut sieve) = (Decoder::new(path, columns), Sieve::default());
        let odd =
            Table::open(path)?.for_each(&columns.names(), |index, values| match decoder.row(index, values)? {
                Some(row) if sieve.rotation_of(&row).is_some() => see(index, &row),
                _ => Ok(()),
            })?;
        let mut notes = self.notes.clone();
        notes.extend(sieve.note());
        notes.extend(decoder.notes());
        add_notes(&mut notes, sieve.looks_activated(), odd.extra_bytes);
        Ok(notes)
    }

    /// Reads some rows, sorted, as a model about a place `far` from the origin of the file.
    pub fn rows(&self, numbers: impl Iterator<Item = u64>, far: DVec3) -> Result<Gaussians> {
        let (path, columns) = (&self.path, &self.columns);
        let (mut rows, mut decoder) = (columns.rows(), Decoder::new(path, columns));
        let Some(mut places) = Table::open(path)?.places_of_rows(&columns.names())? else {
            return Err(Error::data(path, "header", "another file took the place of the model; start again"));
        };
        places.for_some(numbers, |index, values| {
            if let Some(row) = decoder.row(index, values)? {
                rows.push(&row);
            }
            Ok(())
        })?;
        Ok(Gaussians { antialiased: self.antialiased, ..rows.gaussians(self.origin, far) })
    }
}
