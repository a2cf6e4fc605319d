//! Reads SPZ.

use super::record::{self, Records};
use super::{ANTIALIASED_BIT, BITS_MAX, MAGIC, RECORDS_BIT, pack, planes};
use crate::format::ReadModel;
use crate::rows::{Row, Rows};
use crate::side_labels;
use crate::values::logit_of_byte;
use flate2::read::GzDecoder;
use half::f16;
use labelgs_files::read as file;
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Largest expansion of a byte by gzip.
const GZIP_RATIO_MAX: u64 = 1032;
/// Most bytes of positions per byte of a version 4 file, as its readers demand.
const V4_RATIO_MAX: u64 = 1024;
/// Most bytes of records besides labels.
const RECORDS_MAX: u64 = 16 << 20;
const HEADER_BYTES: usize = 16;
const HEADER_V4_BYTES: usize = 32;

struct Header {
    version: u32,
    count: usize,
    sh_degree: u32,
    bits: u32,
    flags: u8,
    /// Number of streams in version 4.
    streams: usize,
}

/// A file with its planes decompressed.
struct UnpackedFile {
    header: Header,
    planes: Vec<Vec<u8>>,
    records: Records,
    notes: Vec<String>,
}

/// Reads an SPZ of version 1 to 4.
pub(super) fn read(path: &Path) -> Result<ReadModel> {
    read_bytes(path, &file::bytes(path)?)
}

/// Reads the bytes of an SPZ; `path` is their source, for messages.
pub fn read_bytes(path: &Path, bytes: &[u8]) -> Result<ReadModel> {
    let UnpackedFile { header, planes, mut records, mut notes } = match bytes.first_chunk::<4>() {
        Some([0x1f, 0x8b, _, _]) => gzipped(path, bytes)?,
        Some(&magic) if u32::from_le_bytes(magic) == MAGIC => framed(path, bytes)?,
        _ => {
            let problem = "starts neither with gzip (versions 1 to 3) nor `NGSP` (version 4); this is not an SPZ file";
            return Err(Error::data(path, "byte 0", problem));
        }
    };
    if records.labels.is_none() {
        records.labels = side_labels::read(path, header.count, crc32fast::hash(&planes[0]), &mut notes)?;
    }
    if header.sh_degree > 3 {
        notes.push("harmonics of degree 4 were omitted; labelgs supports up to degree 3".into());
    }
    let mut read = decode(path, &header, &planes, &records)?;
    notes.append(&mut records.notes);
    notes.append(&mut read.notes);
    Ok(ReadModel { names: records.names, notes, first_view: records.first_view, ..read })
}

fn decode(path: &Path, header: &Header, planes: &[Vec<u8>], records: &Records) -> Result<ReadModel> {
    let widths = super::planes(header.version, header.sh_degree);
    let degree = header.sh_degree.min(3);
    let axes = records.axes.signs;
    let mut rows = Rows::new(degree, records.labels.is_some(), records.confidence.is_some());
    let mut rest = vec![[0.0; 3]; coefficients(degree)];
    for index in 0..header.count {
        let at = |plane: usize| &planes[plane][index * widths[plane]..][..widths[plane]];
        let (place, spin, harmonics) = (at(0), at(4), at(5));
        let position = match header.version {
            1 => [0, 2, 4].map(|at| f16::from_le_bytes([place[at], place[at + 1]]).to_f64()),
            _ => [0, 3, 6].map(|at| pack::decode_position(&place[at..], header.bits)),
        };
        let quat = match *spin {
            [a, b, c, d] => pack::quat([a, b, c, d]),
            _ => pack::old_quat(spin),
        };
        for (triple, bytes) in rest.iter_mut().zip(harmonics.chunks_exact(3)) {
            *triple = [bytes[0], bytes[1], bytes[2]].map(pack::rest);
        }
        axes.rest(&mut rest);
        let triple = |plane: usize, value: fn(u8) -> f32| [at(plane)[0], at(plane)[1], at(plane)[2]].map(value);
        rows.push(&Row {
            position: axes.position(position.map(|value| value as f32)).map(f64::from),
            quat: axes.quat(quat.map(|value| value as f32)).map(f64::from),
            scale: triple(3, pack::scale),
            opacity: logit_of_byte(at(1)[0]),
            sh0: triple(2, pack::sh0),
            rest: &rest,
            label: records.labels.as_ref().map(|labels| labels[index]),
            confidence: records.confidence.as_ref().map(|shares| shares[index]),
        });
    }
    let mut read = rows.finish(path, None)?;
    if let Some(turn) = records.axes.turn() {
        read.gaussians = turn.apply(&read.gaussians)?;
    }
    read.gaussians.antialiased = header.flags & ANTIALIASED_BIT != 0;
    Ok(read)
}

/// Reads the header fields that all versions share.
fn header(path: &Path, bytes: &[u8]) -> Result<Header> {
    let bad = |place: &str, problem: String| Err(Error::data(path, place, problem));
    let Some(head) = bytes.first_chunk::<HEADER_BYTES>() else {
        return bad("header", format!("has {} bytes; expected {HEADER_BYTES}; the file was cut short", bytes.len()));
    };
    let number = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let header = Header {
        version: number(4),
        count: number(8) as usize,
        sh_degree: u32::from(head[12]),
        bits: u32::from(head[13]),
        flags: head[14],
        streams: usize::from(head[15]),
    };
    if number(0) != MAGIC {
        return bad("byte 0", "the packed data does not start with `NGSP`; this is not an SPZ file".into());
    }
    if !(1..=4).contains(&header.version) {
        return bad("byte 4", format!("has version {}; 1 to 4 are read", header.version));
    }
    if header.count == 0 || header.count > i32::MAX as usize {
        return bad("byte 8", format!("has {} Gaussians; expected 1 to {}", header.count, i32::MAX));
    }
    if header.sh_degree > 4 {
        return bad("byte 12", format!("has harmonics of degree {}; expected 0 to 4", header.sh_degree));
    }
    if header.bits > BITS_MAX {
        return bad("byte 13", format!("has {} fractional bits; expected at most {BITS_MAX}", header.bits));
    }
    Ok(header)
}

fn too_large(path: &Path, header: &Header, bytes: usize) -> Error {
    let problem = format!(
        "promises {} Gaussians, more than a file of {bytes} bytes can hold; it was cut short or its header is wrong",
        header.count
    );
    Error::data(path, "byte 8", problem)
}

/// Decompresses versions 1 to 3.
fn gzipped(path: &Path, bytes: &[u8]) -> Result<UnpackedFile> {
    let broken = |place: &'static str| {
        move |error: std::io::Error| {
            Error::data(path, place, format!("cannot be unpacked: {error}; the file was cut short or changed"))
        }
    };
    let mut stream = GzDecoder::new(bytes);
    let mut head = Vec::new();
    (&mut stream).take(HEADER_BYTES as u64).read_to_end(&mut head).map_err(broken("header"))?;
    let header = header(path, &head)?;
    if header.version == 4 {
        return Err(Error::data(path, "byte 4", "has version 4 inside gzip; that version is not packed as a whole"));
    }
    let widths = planes(header.version, header.sh_degree);
    let needed = header.count as u64 * widths.iter().sum::<usize>() as u64;
    if needed > GZIP_RATIO_MAX * bytes.len() as u64 {
        return Err(too_large(path, &header, bytes.len()));
    }
    let mut unpacked = Vec::new();
    for width in widths {
        let (length, mut plane) = (header.count * width, Vec::new());
        (&mut stream).take(length as u64).read_to_end(&mut plane).map_err(broken("planes"))?;
        if plane.len() != length {
            return Err(too_large(path, &header, bytes.len()));
        }
        unpacked.push(plane);
    }
    let mut rest = Vec::new();
    let most = RECORDS_MAX + 5 * header.count as u64;
    (&mut stream).take(most).read_to_end(&mut rest).map_err(broken("end"))?;
    let mut notes = Vec::new();
    let records = if header.flags & RECORDS_BIT != 0 {
        record::read(path, &rest, header.count)?
    } else {
        if !rest.is_empty() {
            notes.push(format!("{} bytes after the last Gaussian were ignored", rest.len()));
        }
        Records::default()
    };
    Ok(UnpackedFile { header, planes: unpacked, records, notes })
}

/// Decompresses version 4.
fn framed(path: &Path, bytes: &[u8]) -> Result<UnpackedFile> {
    let header = header(path, bytes)?;
    let bad = |place: &str, problem: String| Error::data(path, place, problem);
    if header.version != 4 {
        return Err(bad("byte 4", format!("has version {} without gzip; only version 4 may", header.version)));
    }
    if 9 * header.count as u64 > V4_RATIO_MAX * bytes.len() as u64 {
        return Err(too_large(path, &header, bytes.len()));
    }
    let widths = planes(4, header.sh_degree);
    let streams = widths.iter().filter(|&&width| width > 0).count();
    if header.streams != streams {
        let problem = format!("has {} streams; expected {streams} for degree {}", header.streams, header.sh_degree);
        return Err(bad("byte 15", problem));
    }
    let table = bytes.get(16..20).map_or(0, |at| u32::from_le_bytes([at[0], at[1], at[2], at[3]]) as usize);
    let Some(mut frames) = bytes.get(table + 16 * streams..).filter(|_| table >= HEADER_V4_BYTES) else {
        let problem = format!("puts the table of sizes at byte {table}, beyond the file; it was cut short or changed");
        return Err(bad("byte 16", problem));
    };
    let mut unpacked = Vec::new();
    for (stream, width) in widths.into_iter().enumerate() {
        let length = header.count * width;
        if width == 0 {
            unpacked.push(Vec::new());
            continue;
        }
        let place = format!("stream {stream}");
        let sizes = &bytes[table + 16 * stream..][..16];
        let [packed, plain] =
            [0, 8].map(|at| sizes[at..at + 8].iter().rev().fold(0_u64, |size, &byte| size << 8 | u64::from(byte)));
        if plain != length as u64 {
            return Err(bad(&place, format!("has {plain} bytes; expected {length} for {} Gaussians", header.count)));
        }
        let Some((frame, rest)) = usize::try_from(packed).ok().and_then(|packed| frames.split_at_checked(packed))
        else {
            return Err(bad(&place, format!("promises {packed} packed bytes; only {} are left", frames.len())));
        };
        let mut plane = Vec::new();
        let decoder =
            zstd::Decoder::new(frame).and_then(|stream| stream.take(length as u64 + 1).read_to_end(&mut plane));
        decoder
            .map_err(|error| bad(&place, format!("cannot be unpacked: {error}; the file was cut short or changed")))?;
        if plane.len() != length {
            return Err(bad(&place, format!("does not unpack to {length} bytes")));
        }
        unpacked.push(plane);
        frames = rest;
    }
    let notes = (!frames.is_empty()).then(|| format!("{} bytes after the last stream were ignored", frames.len()));
    let has_records = header.flags & RECORDS_BIT != 0;
    let records = if has_records {
        record::read(path, &bytes[HEADER_V4_BYTES..table], header.count)?
    } else {
        Records::default()
    };
    Ok(UnpackedFile { header, planes: unpacked, records, notes: notes.into_iter().collect() })
}
