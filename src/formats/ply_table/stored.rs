//! Reads rows of a binary PLY in any order.

use super::header::decode;
use super::table::Column;
use labelgs_files::read::Source;
use labelgs_scene::{Error, Result};
use std::io::{BufReader, Read};
use std::path::PathBuf;

/// The rows of an element in an open file, from the first one.
pub struct StoredRows {
    pub(super) path: PathBuf,
    pub(super) file: BufReader<Source>,
    /// Bytes of a row.
    pub(super) stride: usize,
    pub(super) columns: Vec<Column>,
    pub(super) big_endian: bool,
}

impl StoredRows {
    /// Calls `see` with the numbers and values of some rows, sorted, like [`Table::for_each`](super::Table::for_each).
    pub fn for_some(
        mut self,
        rows: impl Iterator<Item = u64>,
        mut see: impl FnMut(u64, &[f64]) -> Result<()>,
    ) -> Result<()> {
        let (mut bytes, mut values) = (vec![0u8; self.stride], vec![0.0; self.columns.len()]);
        let mut next = 0;
        for row in rows {
            // A short seek stays within the buffer.
            let skip = (row - next) as i64 * self.stride as i64;
            self.file.seek_relative(skip).map_err(Error::read(&self.path))?;
            self.file.read_exact(&mut bytes).map_err(Error::read(&self.path))?;
            for (value, column) in values.iter_mut().zip(&self.columns) {
                *value = decode(&column.scalar, &bytes[column.offset..], self.big_endian);
            }
            see(row, &values)?;
            next = row + 1;
        }
        Ok(())
    }
}
