//! A model that stays in its file. Rows are scanned in order or read on demand.

use super::columns::Columns;
use super::decode::Decoder;
use super::{add_notes, first_view, is_antialiased, origin, packed};
use crate::format::FirstView;
use crate::ply_table::Table;
use crate::rows::{Row, RowFilter};
use glam::DVec3;
use labelgs_scene::{Error, Gaussians, Result};
use std::path::{Path, PathBuf};

/// A 3DGS PLY with rows of fixed size.
#[derive(Clone, Debug)]
pub struct StoredModel {
    pub(crate) path: PathBuf,
    columns: Columns,
    /// Number of rows, including those that cannot be rendered.
    pub(crate) count: u64,
    pub(crate) sh_degree: u32,
    pub(crate) has_labels: bool,
    /// World position of the file's (0, 0, 0).
    pub(crate) origin: DVec3,
    notes: Vec<String>,
    antialiased: bool,
    pub(crate) first_view: Option<FirstView>,
}

impl StoredModel {
    /// Opens a file. Returns `None` for a file that must be read whole: ascii, compressed, changed by an editor, or
    /// with positions of another type.
    pub fn open(path: &Path) -> Result<Option<Self>> {
        // A pipe can only be read once.
        if !path.is_file() {
            return Ok(None);
        }
        let table = Table::open(path)?;
        if packed::is_packed(&table) {
            return Ok(None);
        }
        let columns = Columns::find(path, &table)?;
        if columns.state.is_some() || !["x", "y", "z"].iter().all(|name| table.is_single(name)) {
            return Ok(None);
        }
        let (count, antialiased, mut notes) = (table.count(), is_antialiased(table.comments()), Vec::new());
        let origin = match origin(path, &table)? {
            Some(origin) => origin,
            None => crate::origin::read(path, count, &mut notes)?,
        };
        let first_view = first_view(&table);
        let has_places = table.stored_rows(&columns.names())?.is_some();
        let (path, sh_degree, has_labels) = (path.to_owned(), columns.sh_degree, columns.have_labels());
        let read = Self { path, columns, count, sh_degree, has_labels, origin, notes, antialiased, first_view };
        Ok(has_places.then_some(read))
    }

    /// Calls `see` with the number and values of each renderable row, in order. Returns notes for the user.
    pub fn scan(&self, mut see: impl FnMut(u64, &Row)) -> Result<Vec<String>> {
        let (path, columns) = (&self.path, &self.columns);
        let (mut decoder, mut sieve) = (Decoder::new(path, columns), RowFilter::default());
        let each = |index: u64, values: &[f64]| {
            let row = decoder.row(index, values)?;
            if let Some(row) = row.filter(|row| sieve.rotation_of(row).is_some()) {
                see(index, &row);
            }
            Ok(())
        };
        let extra_bytes = Table::open(path)?.for_each(&columns.names(), each)?;
        let mut notes = self.notes.clone();
        notes.extend(sieve.note());
        notes.extend(decoder.notes());
        add_notes(&mut notes, sieve.looks_activated(), extra_bytes);
        Ok(notes)
    }

    /// Reads some rows by their sorted numbers, as a model relative to `far` in the file's coordinates.
    pub fn rows(&self, numbers: impl Iterator<Item = u64>, far: DVec3) -> Result<Gaussians> {
        let (path, columns) = (&self.path, &self.columns);
        let (mut rows, mut decoder) = (columns.rows(), Decoder::new(path, columns));
        let Some(stored) = Table::open(path)?.stored_rows(&columns.names())? else {
            return Err(Error::data(path, "header", "the file was replaced by another one; start again"));
        };
        stored.for_some(numbers, |index, values| {
            if let Some(row) = decoder.row(index, values)? {
                rows.push(&row);
            }
            Ok(())
        })?;
        Ok(Gaussians { antialiased: self.antialiased, ..rows.gaussians(self.origin, far) })
    }
}
