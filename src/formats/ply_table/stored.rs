//! Rows of a binary PLY in any order.

use super::table::Column;
use labelgs_files::read::Source;
use labelgs_scene::{Error, Result};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// The `vertex` rows of an open file.
pub struct StoredRows {
    pub(super) path: PathBuf,
    pub(super) file: BufReader<Source>,
    /// First byte of the rows.
    pub(super) first: u64,
    /// Bytes of a row.
    pub(super) stride: usize,
    pub(super) columns: Vec<Column>,
    pub(super) big_endian: bool,
}

impl StoredRows {
    /// Calls `see` with number and values of some rows, sorted, as [`Table::for_each`](super::Table::for_each) does.
    pub fn for_some(
        &mut self,
        rows: impl Iterator<Item = u64>,
        mut see: impl FnMut(u64, &[f64]) -> Result<()>,
    ) -> Result<()> {
        let (mut bytes, mut values) = (vec![0u8; self.stride], vec![0.0; self.columns.len()]);
        self.file.seek(SeekFrom::Start(self.first)).map_err(Error::read(&self.path))?;
        let mut next = 0;
        for row in rows {
            // A short way stays within what is read already.
            let skip = (row - next) as i64 * self.stride as i64;
            self.file.seek_relative(skip).map_err(Error::read(&self.path))?;
            self.file.read_exact(&mut bytes).map_err(Error::read(&self.path))?;
            for (value, column) in values.iter_mut().zip(&self.columns) {
                *value = column.value(&bytes, self.big_endian);
            }
            see(row, &values)?;
            next = row + 1;
        }
        Ok(())
    }
}
