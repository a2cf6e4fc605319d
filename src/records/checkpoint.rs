//! The checkpoint format: named planes of 32-bit words, and JSON for everything else. Damaged files are refused.
//!
//! | byte | content, little-endian |
//! | --- | --- |
//! | 0 | `labelgsC` |
//! | 8 | version of the format, u32 |
//! | 12 | CRC-32 of everything from byte 24 on, u32 |
//! | 16 | number of bytes from byte 24 on, u64 |
//! | 24 | bytes of the JSON, u64; the JSON; the words of all planes, in its order |

use crate::error::{Error, Result};
use crate::files::{atomic, read};
use crc32fast::Hasher;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Version of the format.
pub const VERSION: u32 = 3;

const MAGIC: [u8; 8] = *b"labelgsC";
/// Number of bytes before the checksummed part.
const HEADER_BYTES: usize = 24;

#[cfg(target_endian = "big")]
compile_error!("checkpoints have the words of planes as the machine has them, little-endian");

/// A named table of words, such as the positions of all Gaussians.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plane {
    /// Name, unique in its file.
    pub name: String,
    /// Words per row.
    pub words: u32,
    /// Values, `[rows, words]`; floats as their bits.
    pub data: Vec<u32>,
}

/// The content of a checkpoint file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Everything except the planes.
    pub meta: Value,
    /// The planes.
    pub planes: Vec<Plane>,
}

#[derive(Serialize, Deserialize)]
struct Contents {
    meta: Value,
    planes: Vec<Shape>,
}

#[derive(Serialize, Deserialize)]
struct Shape {
    name: String,
    rows: u64,
    words: u32,
}

impl Checkpoint {
    /// Writes the file, atomically: the old file stays until the new one is safe on the disk.
    pub fn write(&self, path: &Path) -> Result<()> {
        let shape = |plane: &Plane| {
            let (all, words) = (plane.data.len() as u64, u64::from(plane.words));
            let rows = all.checked_div(words).filter(|rows| rows * words == all);
            let rows = rows.ok_or_else(|| Error::Bug(format!("{}: {all} words in rows of {words}", plane.name)))?;
            Ok(Shape { name: plane.name.clone(), rows, words: plane.words })
        };
        let planes = self.planes.iter().map(shape).collect::<Result<Vec<_>>>()?;
        let json = serde_json::to_vec(&Contents { meta: self.meta.clone(), planes });
        let json = json.map_err(|error| Error::Bug(format!("checkpoint: {error}")))?;
        let mut body = Body::default();
        self.put(&json, &mut body).map_err(Error::write(path))?;
        atomic::write(path, |file| {
            file.write_all(&MAGIC)?;
            file.write_all(&VERSION.to_le_bytes())?;
            file.write_all(&body.sum.finalize().to_le_bytes())?;
            file.write_all(&body.bytes.to_le_bytes())?;
            self.put(&json, file)
        })
    }

    fn put(&self, json: &[u8], out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&(json.len() as u64).to_le_bytes())?;
        out.write_all(json)?;
        self.planes.iter().try_for_each(|plane| out.write_all(bytemuck::cast_slice(&plane.data)))
    }

    /// Reads a file. A truncated, extended or modified file, or another version, is an error that says so. Memory use
    /// is about the size of the file, whatever its content.
    pub fn read(path: &Path) -> Result<Self> {
        let mut file = read::open(path)?;
        let length = file.get_ref().length().map_err(Error::read(path))?;
        check(&mut file, path, length)?;
        file.seek(SeekFrom::Start(HEADER_BYTES as u64)).map_err(Error::read(path))?;
        // The checksum is right, so the file was written with any inconsistency below.
        let odd = |problem: String| Error::data(path, "contents", problem);
        let mut rest = length - HEADER_BYTES as u64;
        let mut take = |bytes: u64| {
            rest =
                rest.checked_sub(bytes).ok_or_else(|| odd(format!("expected {bytes} more bytes than the file has")))?;
            Ok::<usize, Error>(bytes as usize)
        };
        let mut word = [0; 8];
        take(8)?;
        file.read_exact(&mut word).map_err(Error::read(path))?;
        let mut json = vec![0; take(u64::from_le_bytes(word))?];
        file.read_exact(&mut json).map_err(Error::read(path))?;
        let contents: Contents = serde_json::from_slice(&json).map_err(|error| odd(error.to_string()))?;
        let mut planes = Vec::new();
        for Shape { name, rows, words } in contents.planes {
            let bytes = rows.checked_mul(u64::from(words)).and_then(|words| words.checked_mul(4));
            let bytes = take(bytes.ok_or_else(|| odd(format!("{name} has {rows} rows of {words} words")))?)?;
            let mut data = vec![0_u32; bytes / 4];
            file.read_exact(bytemuck::cast_slice_mut(&mut data)).map_err(Error::read(path))?;
            planes.push(Plane { name, words, data });
        }
        if rest > 0 {
            return Err(odd(format!("{rest} bytes are left over")));
        }
        Ok(Self { meta: contents.meta, planes })
    }
}

/// A writer that counts bytes and computes the checksum.
#[derive(Default)]
struct Body {
    sum: Hasher,
    bytes: u64,
}

impl Write for Body {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.sum.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Checks the header, the checksum and the length (`length` bytes) of a file.
fn check(file: &mut impl Read, path: &Path, length: u64) -> Result<()> {
    let refuse = |problem: String| Err(Error::data(path, "", problem));
    let mut header = Vec::with_capacity(HEADER_BYTES);
    file.take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(Error::read(path))?;
    let magic = &header[..header.len().min(MAGIC.len())];
    if !MAGIC.starts_with(magic) {
        return refuse("is not a labelgs checkpoint".to_owned());
    }
    let Ok::<[u8; HEADER_BYTES], _>(header) = header.try_into() else {
        return refuse(format!("was cut short: it has {length} bytes, a checkpoint has more than {HEADER_BYTES}"));
    };
    let u32_at = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let version = u32_at(8);
    if version != VERSION {
        return refuse(format!(
            "has version {version} of the format, labelgs {} reads version {VERSION}; resume with the labelgs \
            version that wrote it",
            env!("CARGO_PKG_VERSION")
        ));
    }
    let body = u64::from(u32_at(16)) | u64::from(u32_at(20)) << 32;
    let whole = body.saturating_add(HEADER_BYTES as u64);
    if length != whole {
        let what = if length < whole { "was cut short" } else { "grew" };
        return refuse(format!("{what}: it has {length} bytes, but {whole} were written"));
    }
    let mut body = Body::default();
    io::copy(file, &mut body).map_err(Error::read(path))?;
    let (found, written) = (body.sum.finalize(), u32_at(12));
    if found != written {
        return refuse(format!("is corrupt: its checksum is {found:08x}, expected {written:08x}"));
    }
    Ok(())
}
