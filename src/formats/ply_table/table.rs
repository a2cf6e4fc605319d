//! An element of a PLY file as rows of selected columns.

use super::header::{layout_of, read_header};
use super::stored::StoredRows;
use labelgs_files::read::{self, Source};
use labelgs_scene::{Error, Result};
use ply_rs_bw::ply::{ElementDef, Encoding, PropertyType, ScalarType};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Most bytes in a line of an ascii row.
const LINE_MAX: u64 = 64 * 1024;

/// An open PLY file after its header, before the rows of an element.
pub struct Table {
    path: PathBuf,
    file: BufReader<Source>,
    encoding: Encoding,
    comments: Vec<String>,
    element: ElementDef,
    /// Elements before this one; their rows are skipped.
    before: Vec<ElementDef>,
    /// Whether another element follows.
    after: bool,
    header_bytes: u64,
    file_bytes: u64,
}

/// A column: its index among the properties, its offset in a binary row, and its type.
pub(super) struct Column {
    index: usize,
    pub(super) offset: usize,
    pub(super) scalar: ScalarType,
}

impl Table {
    /// Opens the element `vertex` of a file.
    pub fn open(path: &Path) -> Result<Self> {
        let problem = "has no element `vertex`; this is not a file of Gaussians or points";
        Self::open_element(path, "vertex")?.ok_or_else(|| Error::data(path, "header", problem))
    }

    /// Opens an element of a file, if the file has it.
    pub fn open_element(path: &Path, name: &str) -> Result<Option<Self>> {
        let mut file = read::open(path)?;
        let file_bytes = file.get_ref().length().map_err(Error::read(path))?;
        let (header, header_bytes) = read_header(path, &mut file)?;
        let mut before: Vec<ElementDef> = header.elements.into_iter().map(|(_, element)| element).collect();
        let Some(at) = before.iter().position(|element| element.name == name) else { return Ok(None) };
        let after = before.len() > at + 1;
        let element = before.swap_remove(at);
        before.truncate(at);
        let (path, header_bytes) = (path.to_owned(), header_bytes as u64);
        let (encoding, comments) = (header.encoding, header.comments);
        Ok(Some(Self { path, file, encoding, comments, element, before, after, header_bytes, file_bytes }))
    }

    /// Returns the names of the properties in file order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.element.properties.values().map(|property| property.name.as_str())
    }

    /// Returns true if the element has the property.
    pub fn has(&self, name: &str) -> bool {
        self.element.properties.contains_key(name)
    }

    /// Returns the comments of the header.
    pub fn comments(&self) -> impl Iterator<Item = &str> {
        self.comments.iter().map(String::as_str)
    }

    /// Returns the largest value of an integer property, or `None` for floats and lists.
    pub fn integer_max(&self, name: &str) -> Option<f64> {
        match self.element.properties.get(name)?.data_type {
            PropertyType::Scalar(ScalarType::UShort) => Some(f64::from(u16::MAX)),
            PropertyType::Scalar(ScalarType::Float | ScalarType::Double) | PropertyType::List(..) => None,
            // Wider integers may store bytes too.
            PropertyType::Scalar(_) => Some(255.0),
        }
    }

    /// Returns the number of rows that the header promises.
    pub fn count(&self) -> u64 {
        self.element.count as u64
    }

    /// Returns true if the property exists and is `float`.
    pub fn is_single(&self, name: &str) -> bool {
        let property = self.element.properties.get(name);
        property.is_some_and(|property| matches!(property.data_type, PropertyType::Scalar(ScalarType::Float)))
    }

    /// Calls `see` with the number of each row and its values of `columns`, as f64, in order. Returns the number of
    /// bytes after the last declared element.
    pub fn for_each(mut self, columns: &[&str], mut see: impl FnMut(u64, &[f64]) -> Result<()>) -> Result<u64> {
        let (columns, count) = (self.locate(columns)?, self.count());
        if self.encoding == Encoding::Ascii {
            return self.ascii_rows(&columns, &mut see).map(|()| 0);
        }
        let (rows, extra_bytes) = self.binary_rows(columns)?;
        rows.for_some(0..count, see)?;
        Ok(extra_bytes)
    }

    /// Returns random access to the rows, with the values of `columns`; `None` for ascii, whose rows have no fixed
    /// offsets.
    pub fn stored_rows(self, columns: &[&str]) -> Result<Option<StoredRows>> {
        if self.encoding == Encoding::Ascii {
            return Ok(None);
        }
        let columns = self.locate(columns)?;
        self.binary_rows(columns).map(|(rows, _)| Some(rows))
    }

    fn locate(&self, columns: &[&str]) -> Result<Vec<Column>> {
        let missing: Vec<&str> = columns.iter().copied().filter(|&column| !self.has(column)).collect();
        if !missing.is_empty() {
            let problem = format!("`{}` lacks the properties {}", self.element.name, missing.join(" "));
            return Err(Error::data(&self.path, "header", problem));
        }
        let (layout, _) = layout_of(&self.path, &self.element)?;
        let column = |name: &&str| {
            let index = self.element.properties.keys().position(|key| key == name).unwrap_or_default();
            Column { index, offset: layout[index].0, scalar: layout[index].1.clone() }
        };
        Ok(columns.iter().map(column).collect())
    }

    /// Returns the rows of a binary file, and the number of bytes after the last declared element. Fails if the file is
    /// too short.
    fn binary_rows(mut self, columns: Vec<Column>) -> Result<(StoredRows, u64)> {
        let (mut skip, count, (_, stride)) = (0, self.count(), layout_of(&self.path, &self.element)?);
        for element in &self.before {
            skip += layout_of(&self.path, element)?.1 as u128 * element.count as u128;
        }
        let needed = u128::from(self.header_bytes) + skip + stride as u128 * u128::from(count);
        if needed > u128::from(self.file_bytes) {
            let problem = format!(
                "the header promises {count} rows of {stride} bytes of `{}`, which ends at byte {needed}; the file has {}; \
                 it was cut short or its header is wrong",
                self.element.name, self.file_bytes
            );
            return Err(Error::data(&self.path, "header", problem));
        }
        self.file.seek_relative(skip as i64).map_err(Error::read(&self.path))?;
        let extra_bytes = if self.after { 0 } else { self.file_bytes - needed as u64 };
        let big_endian = self.encoding == Encoding::BinaryBigEndian;
        Ok((StoredRows { path: self.path, file: self.file, stride, columns, big_endian }, extra_bytes))
    }

    fn ascii_rows(&mut self, columns: &[Column], see: &mut impl FnMut(u64, &[f64]) -> Result<()>) -> Result<()> {
        let skip: u128 = self.before.iter().map(|element| element.count as u128).sum();
        let mut line = Vec::new();
        for _ in 0..skip {
            self.line(&mut line, &format!("an element before `{}`", self.element.name))?;
        }
        let (width, mut values) = (self.element.properties.len(), vec![0.0; columns.len()]);
        for index in 0..self.count() {
            let place = format!("{} {index}", self.element.name);
            self.line(&mut line, &place)?;
            let problem = |problem: String| Error::data(&self.path, place.as_str(), problem);
            let text = str::from_utf8(&line).map_err(|_| problem("is not text".into()))?;
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if words.len() != width {
                return Err(problem(format!("has {} values; the header declares {width}", words.len())));
            }
            for (value, column) in values.iter_mut().zip(columns) {
                let word = words[column.index];
                *value = word.parse().map_err(|_| problem(format!("`{word}` is not a number")))?;
            }
            see(index, &values)?;
        }
        Ok(())
    }

    /// Reads the next line that is not empty.
    fn line(&mut self, line: &mut Vec<u8>, what: &str) -> Result<()> {
        loop {
            line.clear();
            let mut limited = (&mut self.file).take(LINE_MAX);
            let read = limited.read_until(b'\n', line).map_err(Error::read(&self.path))?;
            if read == 0 {
                return Err(Error::data(&self.path, what, "is missing because the file ends here; it was cut short"));
            }
            if read as u64 == LINE_MAX {
                return Err(Error::data(&self.path, what, format!("a line is longer than {LINE_MAX} bytes")));
            }
            if line.iter().any(|byte| !byte.is_ascii_whitespace()) {
                return Ok(());
            }
        }
    }
}
