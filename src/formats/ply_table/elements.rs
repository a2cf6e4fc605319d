//! All elements of a little-endian PLY, for formats with more than `vertex`.

use super::table::{decode, layout_of, read_header, stride_of};
use labelgs_files::read;
use labelgs_scene::{Error, Result};
use ply_rs_bw::ply::{ElementDef, Encoding, ScalarType};
use std::path::{Path, PathBuf};

/// A PLY in memory.
pub struct Elements {
    path: PathBuf,
    bytes: Vec<u8>,
    header_bytes: usize,
    encoding: Encoding,
    elements: Vec<ElementDef>,
    comments: Vec<String>,
}

/// Columns of an element.
pub struct Scalars<'a> {
    bytes: &'a [u8],
    stride: usize,
    rows: usize,
    columns: Vec<(usize, ScalarType)>,
}

impl Scalars<'_> {
    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn value(&self, row: usize, column: usize) -> f64 {
        let (offset, scalar) = &self.columns[column];
        decode(scalar, &self.bytes[row * self.stride + offset..], false)
    }

    pub fn row<const N: usize>(&self, row: usize) -> [f64; N] {
        std::array::from_fn(|column| self.value(row, column))
    }
}

impl Elements {
    /// Reads the header; the rest is read only if some element has the property `if_property`.
    pub fn open(path: &Path, if_property: &str) -> Result<Option<Self>> {
        let mut file = read::open(path)?;
        let (header, header_bytes) = read_header(path, &mut file)?;
        let comments = header.comments;
        let elements: Vec<ElementDef> = header.elements.into_iter().map(|(_, element)| element).collect();
        if !elements.iter().any(|element| element.properties.contains_key(if_property)) {
            return Ok(None);
        }
        drop(file);
        let bytes = read::bytes(path)?;
        Ok(Some(Self { path: path.to_owned(), bytes, header_bytes, encoding: header.encoding, elements, comments }))
    }

    /// Returns the comments of the header.
    pub fn comments(&self) -> impl Iterator<Item = &str> {
        self.comments.iter().map(String::as_str)
    }

    /// Returns true if an element has a property.
    pub fn has(&self, element: &str, property: &str) -> bool {
        let mut elements = self.elements.iter();
        elements.any(|own| own.name == element && own.properties.contains_key(property))
    }

    /// Returns columns of an element.
    pub fn columns(&self, element: &str, names: &[&str]) -> Result<Scalars<'_>> {
        let bad = |problem: String| Error::data(&self.path, "header", problem);
        if self.encoding != Encoding::BinaryLittleEndian {
            return Err(bad("is not binary_little_endian, as a compressed PLY is; export it again".into()));
        }
        let mut start = self.header_bytes as u128;
        for own in &self.elements {
            let layout = layout_of(&self.path, own)?;
            let stride = stride_of(&layout);
            let length = stride as u128 * own.count as u128;
            if own.name != element {
                start += length;
                continue;
            }
            if start + length > self.bytes.len() as u128 {
                let problem = format!(
                    "promises {} rows of `{element}`, which end at byte {}; the file has {}; it was cut short or its header \
                     is wrong",
                    own.count,
                    start + length,
                    self.bytes.len()
                );
                return Err(bad(problem));
            }
            let column = |name: &&str| {
                let at = own.properties.keys().position(|key| key == name);
                at.map(|at| layout[at].clone()).ok_or_else(|| bad(format!("`{element}` lacks the property {name}")))
            };
            let columns = names.iter().map(column).collect::<Result<_>>()?;
            return Ok(Scalars { bytes: &self.bytes[start as usize..], stride, rows: own.count, columns });
        }
        Err(bad(format!("has no element `{element}`; a compressed PLY has `chunk` and `vertex`")))
    }
}
