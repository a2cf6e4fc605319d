//! The archive of a SOG and its pictures.

use image_webp::{ColorType, WebPDecoder, WebPEncoder};
use labelgs_scene::{Error, Result};
use std::io::{self, Cursor, Read, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Most samples that a byte of a picture may stand for, and how many more: pictures of one colour take few bytes.
const SAMPLES_PER_BYTE: u64 = 8192;
const SAMPLES_MORE: u64 = 1 << 22;
/// Largest side of a picture.
const SIDE_MAX: u32 = 16_383;

/// A picture of R, G, B, A.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) texels: Vec<[u8; 4]>,
}

pub(super) struct Archive<'a> {
    path: &'a Path,
    zip: ZipArchive<Cursor<&'a [u8]>>,
    length: u64,
}

impl<'a> Archive<'a> {
    pub(super) fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            Error::data(path, "end of the archive", format!("{error}; this is no SOG file, or it was cut short"))
        })?;
        Ok(Self { path, zip, length: bytes.len() as u64 })
    }

    /// Returns the bytes of an entry.
    pub(super) fn file(&mut self, name: &str) -> Result<Vec<u8>> {
        let bad = |problem: String| Error::data(self.path, name, format!("{problem}; export the file again"));
        let entry = self.zip.by_name(name).map_err(|error| bad(format!("cannot be found in the archive: {error}")))?;
        let mut bytes = Vec::new();
        // Entries are stored as they are.
        entry.take(self.length).read_to_end(&mut bytes).map_err(|error| bad(format!("cannot be unpacked: {error}")))?;
        Ok(bytes)
    }

    /// Returns a picture.
    pub(super) fn picture(&mut self, name: &str) -> Result<Picture> {
        let bytes = self.file(name)?;
        let bad = |problem: String| Error::data(self.path, name, format!("{problem}; export the file again"));
        let broken = |error: image_webp::DecodingError| bad(format!("is no WebP picture: {error}"));
        let mut decoder = WebPDecoder::new(Cursor::new(&bytes)).map_err(broken)?;
        let (width, height) = decoder.dimensions();
        let samples = 4 * u64::from(width) * u64::from(height);
        if width.max(height) > SIDE_MAX || samples > SAMPLES_MORE + SAMPLES_PER_BYTE * bytes.len() as u64 {
            return Err(bad(format!("is {width} x {height} in {} bytes, more than they can hold", bytes.len())));
        }
        if decoder.is_animated() {
            return Err(bad("is animated; expected one picture".into()));
        }
        let size = decoder.output_buffer_size().ok_or_else(|| bad(format!("is {width} x {height}, too large")))?;
        let mut pixels = vec![0; size];
        decoder.read_image(&mut pixels).map_err(broken)?;
        let texels = if decoder.has_alpha() {
            pixels.as_chunks::<4>().0.to_vec()
        } else {
            pixels.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect()
        };
        Ok(Picture { width: width as usize, texels })
    }
}

/// Packs files into an archive, stored as they are, with a fixed date.
pub(super) fn pack(files: Vec<(String, Vec<u8>)>) -> io::Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default());
    for (name, bytes) in files {
        zip.start_file(name, stored)?;
        zip.write_all(&bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// Encodes a picture of this width without loss; missing pixels at the end are 0.
pub(super) fn encode(texels: &[[u8; 4]], width: usize, height: usize) -> io::Result<Vec<u8>> {
    let mut pixels = texels.as_flattened().to_vec();
    pixels.resize(4 * width * height, 0);
    let mut bytes = Vec::new();
    let encoder = WebPEncoder::new(&mut bytes);
    encoder.encode(&pixels, width as u32, height as u32, ColorType::Rgba8).map_err(io::Error::other)?;
    Ok(bytes)
}
