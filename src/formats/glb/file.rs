//! The chunks of a GLB.

use crate::format::Export;
use labelgs_scene::{Error, Result};
use serde_json::Value;
use std::io::{self, Write};
use std::path::Path;

const MAGIC: &[u8; 4] = b"glTF";
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";
/// Most bytes in the binary chunk: lengths have 32 bits, and the JSON needs some.
pub(super) const BYTES_MAX: u64 = u32::MAX as u64 - (64 << 20);

/// Bytes per Gaussian in the binary chunk.
pub(super) fn bytes_per_row(export: &Export) -> u64 {
    let labels = usize::from(export.labels().is_some()) + usize::from(export.label_confidence().is_some());
    4 * (18 + 3 * export.model.rest_per_gaussian() + labels) as u64
}

/// Writes both chunks. The length of `binary` is a multiple of 8.
pub(super) fn write(root: &Value, binary: &[u8], out: &mut dyn Write) -> io::Result<()> {
    let mut text = serde_json::to_vec(root)?;
    // Align the numbers to 8 bytes, as tables require: 12 + 8 bytes precede the JSON, 8 follow it.
    text.resize((text.len() + 28).next_multiple_of(8) - 28, b' ');
    let length = |bytes: usize| (bytes as u32).to_le_bytes();
    out.write_all(MAGIC)?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length(12 + 8 + text.len() + 8 + binary.len()))?;
    for (kind, bytes) in [(JSON_CHUNK, text.as_slice()), (BINARY_CHUNK, binary)] {
        out.write_all(&length(bytes.len()))?;
        out.write_all(kind)?;
        out.write_all(bytes)?;
    }
    Ok(())
}

/// Returns the JSON and binary chunks of a file.
pub(super) fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Value, &'a [u8])> {
    let bad = |place: &str, problem: String| Error::data(path, place, problem);
    if bytes.get(..4) != Some(MAGIC) {
        return Err(bad("byte 0", "does not start with `glTF`; this is not a GLB file".into()));
    }
    let number = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if number(4) != Some(2) {
        return Err(bad("byte 4", "has a version other than 2; export it as glTF 2.0".into()));
    }
    let mut at = 12;
    let mut chunk = |kind: &[u8; 4]| {
        let length = number(at).unwrap_or(0) as usize;
        let found = bytes.get(at + 4..at + 8).filter(|own| own == kind).and_then(|_| bytes[at + 8..].get(..length));
        let name = String::from_utf8_lossy(kind).trim_end_matches('\0').to_owned();
        let start = at;
        at += 8 + length;
        found.ok_or_else(|| {
            bad(&format!("byte {start}"), format!("has no complete chunk `{name}`; the file was cut short or changed"))
        })
    };
    let (text, binary) = (chunk(JSON_CHUNK)?, chunk(BINARY_CHUNK)?);
    let root = serde_json::from_slice(text)
        .map_err(|error| bad("JSON chunk", format!("{error}; the file was changed, export it again")))?;
    Ok((root, binary))
}
