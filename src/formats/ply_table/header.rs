//! The header of a PLY file, and the layout of a binary row.

use labelgs_files::content::identify;
use labelgs_scene::{Error, Result};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Header, PropertyType, ScalarType};
use std::io::{BufRead, Read};
use std::path::Path;

/// Most bytes of a header; a 3DGS header has about 1.5 KiB.
const HEADER_MAX: u64 = 64 * 1024;
/// The byte order mark that some text editors write first.
const BOM: &[u8] = b"\xEF\xBB\xBF";

/// Reads and parses the header; also returns its length.
pub(super) fn read_header(path: &Path, file: &mut impl BufRead) -> Result<(Header, usize)> {
    let text = header_bytes(path, file)?;
    Ok((parse_header(path, &text)?, text.len()))
}

/// Reads the header including the `end_header` line, at most [`HEADER_MAX`] bytes.
fn header_bytes(path: &Path, file: &mut impl BufRead) -> Result<Vec<u8>> {
    let content = identify(file.fill_buf().map_err(Error::read(path))?);
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
            return Err(Error::data(path, "byte 0", content.map_or_else(unknown, |content| content.mismatch("a PLY"))));
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

/// Returns the header with single spaces between words and without a byte order mark. Replaces invalid UTF-8, which may
/// occur in comments with names of users and folders.
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
    // The crate keeps the last of two properties with the same name, which would shift later columns.
    let lines = |word: &str| text.lines().filter(|line| line.split(' ').next() == Some(word)).count();
    let kept: usize = header.elements.values().map(|element| element.properties.len()).sum();
    if lines("property") != kept || lines("element") != header.elements.len() {
        return Err(problem("declares an element or a property twice".into()));
    }
    Ok(header)
}

/// Returns the offset and scalar type of each property of a binary row, and the row's length in bytes. Refuses lists.
pub(super) fn layout_of(path: &Path, element: &ElementDef) -> Result<(Vec<(usize, ScalarType)>, usize)> {
    let mut stride = 0;
    let mut layout = Vec::with_capacity(element.properties.len());
    for property in element.properties.values() {
        let PropertyType::Scalar(scalar) = &property.data_type else {
            let problem = format!("list property `{}` in element `{}` is not supported", property.name, element.name);
            return Err(Error::data(path, "header", problem));
        };
        layout.push((stride, scalar.clone()));
        stride += match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        };
    }
    Ok((layout, stride))
}

/// Decodes the scalar at the start of `bytes`; f64 represents every PLY scalar exactly.
pub(super) fn decode(scalar: &ScalarType, bytes: &[u8], big_endian: bool) -> f64 {
    macro_rules! number {
        ($type:ty) => {{
            let mut raw = [0; size_of::<$type>()];
            raw.copy_from_slice(&bytes[..size_of::<$type>()]);
            if big_endian { <$type>::from_be_bytes(raw) as f64 } else { <$type>::from_le_bytes(raw) as f64 }
        }};
    }
    match scalar {
        ScalarType::Char => number!(i8),
        ScalarType::UChar => number!(u8),
        ScalarType::Short => number!(i16),
        ScalarType::UShort => number!(u16),
        ScalarType::Int => number!(i32),
        ScalarType::UInt => number!(u32),
        ScalarType::Float => number!(f32),
        ScalarType::Double => number!(f64),
    }
}
