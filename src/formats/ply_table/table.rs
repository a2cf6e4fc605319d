//! The `vertex` element of a PLY file as rows of selected columns.

use super::stored::StoredRows;
use labelgs_files::kind::name_of_content;
use labelgs_files::read::{self, Source};
use labelgs_scene::{Error, Result};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, Header, PropertyType, ScalarType};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Most bytes of a header; that of a 3DGS file has about 1.5 KiB.
const HEADER_MAX: u64 = 64 * 1024;
/// The byte order mark that some editors of text write first.
const BOM: &[u8] = b"\xEF\xBB\xBF";
/// Most bytes in a line of an ascii row.
const LINE_MAX: u64 = 64 * 1024;

/// An open PLY file after its header, before its `vertex` rows.
pub struct Table {
    path: PathBuf,
    file: BufReader<Source>,
    encoding: Encoding,
    comments: Vec<String>,
    vertex: ElementDef,
    /// Elements before `vertex`; their rows are skipped.
    before: Vec<ElementDef>,
    after: bool,
    header_bytes: u64,
    file_bytes: u64,
}

/// A column: its offset in a row and its type.
pub(super) struct Column {
    index: usize,
    offset: usize,
    scalar: ScalarType,
}

impl Column {
    /// Returns the value in a row.
    pub(super) fn value(&self, row: &[u8], big_endian: bool) -> f64 {
        decode(&self.scalar, &row[self.offset..], big_endian)
    }
}

fn size_of(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Decodes the scalar at the start of `bytes`; f64 holds every PLY scalar exactly.
pub(super) fn decode(scalar: &ScalarType, bytes: &[u8], big_endian: bool) -> f64 {
    macro_rules! number {
        ($type:ty, $bytes:expr) => {{
            let mut raw = [0u8; size_of::<$type>()];
            raw.copy_from_slice(&$bytes[..size_of::<$type>()]);
            if big_endian { <$type>::from_be_bytes(raw) as f64 } else { <$type>::from_le_bytes(raw) as f64 }
        }};
    }
    use std::mem::size_of;
    match scalar {
        ScalarType::Char => number!(i8, bytes),
        ScalarType::UChar => number!(u8, bytes),
        ScalarType::Short => number!(i16, bytes),
        ScalarType::UShort => number!(u16, bytes),
        ScalarType::Int => number!(i32, bytes),
        ScalarType::UInt => number!(u32, bytes),
        ScalarType::Float => number!(f32, bytes),
        ScalarType::Double => number!(f64, bytes),
    }
}

impl Table {
    /// Opens `path` and reads its header.
    pub fn open(path: &Path) -> Result<Self> {
        let mut file = read::open(path)?;
        let file_bytes = file.get_ref().length().map_err(Error::read(path))?;
        let (header, header_bytes) = read_header(path, &mut file)?;
        let mut elements: Vec<ElementDef> = header.elements.into_iter().map(|(_, element)| element).collect();
        if elements.iter().any(|element| element.properties.contains_key("packed_position")) {
            let cure = "a compressed PLY, which is read as a model only; convert it to a plain PLY first";
            return Err(Error::data(path, "header", cure));
        }
        let Some(at) = elements.iter().position(|element| element.name == "vertex") else {
            return Err(Error::data(
                path,
                "header",
                "has no element `vertex`; this is not a file of Gaussians or points",
            ));
        };
        let after = elements.len() > at + 1;
        let vertex = elements.swap_remove(at);
        elements.truncate(at);
        let header_bytes = header_bytes as u64;
        Ok(Self {
            path: path.to_owned(),
            file,
            encoding: header.encoding,
            comments: header.comments,
            vertex,
            before: elements,
            after,
            header_bytes,
            file_bytes,
        })
    }

    /// Returns the names of the vertex properties in file order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.vertex.properties.iter().map(|(_, property)| property.name.as_str())
    }

    /// Returns the comments of the header.
    pub fn comments(&self) -> impl Iterator<Item = &str> {
        self.comments.iter().map(String::as_str)
    }

    /// Returns the largest value of a property of integers, and `None` for one of floats or lists.
    pub fn integer_max(&self, name: &str) -> Option<f64> {
        match self.vertex.properties.get(name)?.data_type {
            PropertyType::Scalar(ScalarType::UShort) => Some(f64::from(u16::MAX)),
            PropertyType::Scalar(ScalarType::Float | ScalarType::Double) | PropertyType::List(..) => None,
            // Wider integers hold bytes too.
            PropertyType::Scalar(_) => Some(255.0),
        }
    }

    /// Calls `row` with the values of `columns` for each vertex, as f64, in order.
    pub fn for_each(mut self, columns: &[&str], mut row: impl FnMut(u64, &[f64]) -> Result<()>) -> Result<Notes> {
        let located = self.locate(columns)?;
        match self.encoding {
            Encoding::Ascii => self.ascii_rows(&located, &mut row),
            Encoding::BinaryBigEndian => self.binary_rows(&located, true, &mut row),
            Encoding::BinaryLittleEndian => self.binary_rows(&located, false, &mut row),
        }
    }

    fn locate(&self, columns: &[&str]) -> Result<Vec<Column>> {
        let missing: Vec<&str> = columns.iter().copied().filter(|&c| !self.vertex.properties.contains_key(c)).collect();
        if !missing.is_empty() {
            let problem = format!("`vertex` lacks the properties {}", missing.join(" "));
            return Err(Error::data(&self.path, "header", problem));
        }
        let layout = layout_of(&self.path, &self.vertex)?;
        let column = |name: &&str| {
            let index = self.vertex.properties.keys().position(|key| key == name).unwrap_or_default();
            Column { index, offset: layout[index].0, scalar: layout[index].1.clone() }
        };
        Ok(columns.iter().map(column).collect())
    }

    fn binary_rows(
        &mut self,
        columns: &[Column],
        big_endian: bool,
        row: &mut impl FnMut(u64, &[f64]) -> Result<()>,
    ) -> Result<Notes> {
        let (skip, stride) = self.places()?;
        self.file.seek_relative(skip as i64).map_err(Error::read(&self.path))?;
        let mut bytes = vec![0u8; stride];
        let mut values = vec![0.0; columns.len()];
        for index in 0..self.vertex.count as u64 {
            self.file.read_exact(&mut bytes).map_err(Error::read(&self.path))?;
            for (value, column) in values.iter_mut().zip(columns) {
                *value = column.value(&bytes, big_endian);
            }
            row(index, &values)?;
        }
        let needed = self.header_bytes + skip + stride as u64 * self.vertex.count as u64;
        Ok(Notes { extra_bytes: if self.after { 0 } else { self.file_bytes - needed } })
    }

    /// Returns the bytes between the header and the first row of a binary file, and the bytes of a row. Fails if the file is
    /// too short for its rows.
    fn places(&self) -> Result<(u64, usize)> {
        let mut skip = 0u128;
        for element in &self.before {
            skip += stride_of(&layout_of(&self.path, element)?) as u128 * element.count as u128;
        }
        let stride = stride_of(&layout_of(&self.path, &self.vertex)?);
        let needed = u128::from(self.header_bytes) + skip + stride as u128 * self.vertex.count as u128;
        if needed > u128::from(self.file_bytes) {
            let problem = format!(
                "the header promises {} vertices of {stride} bytes, which takes {needed} bytes; the file has {}; \
                 it was cut short or its header is wrong",
                self.vertex.count, self.file_bytes
            );
            return Err(Error::data(&self.path, "header", problem));
        }
        Ok((skip as u64, stride))
    }

    /// Returns access to the rows in any order, with the values of `columns`; `None` for text, whose rows have no fixed
    /// places.
    pub fn places_of_rows(self, columns: &[&str]) -> Result<Option<StoredRows>> {
        let big_endian = match self.encoding {
            Encoding::Ascii => return Ok(None),
            Encoding::BinaryBigEndian => true,
            Encoding::BinaryLittleEndian => false,
        };
        let (columns, (skip, stride)) = (self.locate(columns)?, self.places()?);
        let first = self.header_bytes + skip;
        Ok(Some(StoredRows { path: self.path, file: self.file, first, stride, columns, big_endian }))
    }

    /// Returns the number of rows that the header promises.
    pub fn count(&self) -> u64 {
        self.vertex.count as u64
    }

    /// Returns true if the property exists and is `float`.
    pub fn is_single(&self, name: &str) -> bool {
        self.vertex
            .properties
            .get(name)
            .is_some_and(|property| matches!(property.data_type, PropertyType::Scalar(ScalarType::Float)))
    }

    fn ascii_rows(&mut self, columns: &[Column], row: &mut impl FnMut(u64, &[f64]) -> Result<()>) -> Result<Notes> {
        let skip: u128 = self.before.iter().map(|element| element.count as u128).sum();
        let mut line = Vec::new();
        for _ in 0..skip {
            self.line(&mut line, "an element before `vertex`")?;
        }
        let (width, mut values) = (self.vertex.properties.len(), vec![0.0; columns.len()]);
        for index in 0..self.vertex.count as u64 {
            self.line(&mut line, &format!("vertex {index}"))?;
            let problem = |problem: String| Error::data(&self.path, format!("vertex {index}"), problem);
            let text = str::from_utf8(&line).map_err(|_| problem("is not text".into()))?;
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if words.len() != width {
                return Err(problem(format!("has {} values, the header declares {width}", words.len())));
            }
            for (value, column) in values.iter_mut().zip(columns) {
                let word = words[column.index];
                *value = word.parse().map_err(|_| problem(format!("`{word}` is not a number")))?;
            }
            row(index, &values)?;
        }
        Ok(Notes { extra_bytes: 0 })
    }

    /// Reads the next line that is not empty.
    fn line(&mut self, line: &mut Vec<u8>, what: &str) -> Result<()> {
        loop {
            line.clear();
            let mut limited = (&mut self.file).take(LINE_MAX);
            let read = limited.read_until(b'\n', line).map_err(Error::read(&self.path))?;
            if read == 0 {
                return Err(Error::data(&self.path, what, "the file ends before it; it was cut short"));
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

pub struct Notes {
    /// Number of bytes after the last declared element.
    pub extra_bytes: u64,
}

/// Reads and parses the header; returns its length too.
pub(super) fn read_header(path: &Path, file: &mut impl BufRead) -> Result<(Header, usize)> {
    let text = header_bytes(path, file)?;
    Ok((parse_header(path, &text)?, text.len()))
}

/// Reads the header including the `end_header` line, at most [`HEADER_MAX`] bytes.
fn header_bytes(path: &Path, file: &mut impl BufRead) -> Result<Vec<u8>> {
    let content = name_of_content(file.fill_buf().map_err(Error::read(path))?);
    let mut text = Vec::new();
    let mut limited = file.take(HEADER_MAX);
    loop {
        let start = text.len();
        let read = limited.read_until(b'\n', &mut text).map_err(Error::read(path))?;
        let line = text[start..].trim_ascii_end();
        if start == 0 && line.strip_prefix(BOM).unwrap_or(line) != b"ply" {
            if line.starts_with(b"ply\r") {
                let problem = "its lines end with CR alone, as on old Macs; export it again with LF";
                return Err(Error::data(path, "header", problem));
            }
            let unknown = || "does not start with `ply`; this is not a PLY file".to_owned();
            return Err(Error::data(path, "byte 0", content.map_or_else(unknown, |content| content.told("a PLY"))));
        }
        if line == b"end_header" && text.ends_with(b"\n") {
            return Ok(text);
        }
        if read == 0 {
            let problem = format!("no `end_header` line within the first {} bytes", text.len());
            return Err(Error::data(path, "header", problem));
        }
    }
}

/// Returns the header with one space between words and without the byte order mark. Comments are free: bytes that are no
/// UTF-8, as in names of users and folders, are replaced.
fn plain(text: &[u8]) -> Option<String> {
    let mut to = String::with_capacity(text.len());
    for line in text.strip_prefix(BOM).unwrap_or(text).split(|&byte| byte == b'\n') {
        let line = line.trim_ascii();
        if line.starts_with(b"comment") || line.starts_with(b"obj_info") {
            to += &String::from_utf8_lossy(line).replace(['\0', '\r'], " ");
        } else {
            let line = str::from_utf8(line).ok().filter(|line| !line.contains('\0'))?;
            to += &line.split_ascii_whitespace().collect::<Vec<_>>().join(" ");
        }
        if !to.ends_with('\n') {
            to.push('\n');
        }
    }
    Some(to)
}

fn parse_header(path: &Path, text: &[u8]) -> Result<Header> {
    let problem = |problem: String| Error::data(path, "header", problem);
    let text = plain(text).ok_or_else(|| problem("a name of an element or a property is not text".into()))?;
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut Reader::new(text.as_bytes()))
        .map_err(|error| problem(error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")))?;
    // The crate keeps the last of two properties with the same name, which would move the later columns.
    let lines = |word: &str| text.lines().filter(|line| line.split(' ').next() == Some(word)).count();
    let kept: usize = header.elements.values().map(|element| element.properties.len()).sum();
    if lines("property") != kept || lines("element") != header.elements.len() {
        return Err(problem("declares an element or a property twice".into()));
    }
    Ok(header)
}

/// Returns the offset and scalar type of each property of a binary row. Refuses lists.
pub(super) fn layout_of(path: &Path, element: &ElementDef) -> Result<Vec<(usize, ScalarType)>> {
    let mut offset = 0;
    let mut layout = Vec::with_capacity(element.properties.len());
    for property in element.properties.values() {
        let PropertyType::Scalar(scalar) = &property.data_type else {
            let problem = format!("list property `{}` in element `{}` is not supported", property.name, element.name);
            return Err(Error::data(path, "header", problem));
        };
        layout.push((offset, scalar.clone()));
        offset += size_of(scalar);
    }
    Ok(layout)
}

pub(super) fn stride_of(layout: &[(usize, ScalarType)]) -> usize {
    layout.last().map_or(0, |(offset, scalar)| offset + size_of(scalar))
}
