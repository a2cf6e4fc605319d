//! Id images: which object each pixel of a photo shows.
//!
//! The pixel value is the id and 0 is unlabelled: grey PNG of any depth, or palette PNG, whose *index* is the id.
//! Colours are never turned into ids: two palette entries may share a colour, and a colour code needs its legend.

use super::image::{check_png_length, check_size};
use super::resample::same_aspect;
use crate::error::{Error, Result};
use crate::io::read;
use crate::scene::LabelMap;
use png::DecodingError;
use std::collections::HashMap;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};

type Reader = png::Reader<BufReader<read::Source>>;

fn unreadable(path: &Path, error: DecodingError) -> Error {
    match error {
        // A file that was cut short ends too early, as no failing disk does.
        DecodingError::IoError(cause) if cause.kind() != ErrorKind::UnexpectedEof => Error::read(path)(cause),
        other => problem(path, other),
    }
}

fn problem(path: &Path, problem: impl std::fmt::Display) -> Error {
    Error::data(path, "", format!("is no readable PNG mask: {problem}"))
}

/// What a PNG says about itself before its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    /// Width and height, px.
    pub(crate) size: (u32, u32),
    /// Kind of samples.
    pub(crate) colour: png::ColorType,
    /// Bits of a sample.
    pub(crate) depth: png::BitDepth,
}

/// A PNG with its samples as they are stored.
pub(crate) struct Raw {
    /// Its header.
    pub(crate) header: Header,
    bytes: Vec<u8>,
    line_size: usize,
}

impl Raw {
    /// All samples, row-major, the channels of a pixel side by side.
    pub(crate) fn samples(&self) -> Vec<u16> {
        let Header { size, colour, depth } = self.header;
        let per_line = size.0 as usize * colour.samples();
        let lines = self.bytes.chunks_exact(self.line_size).take(size.1 as usize);
        lines.flat_map(|line| unpack(line, depth, per_line)).collect()
    }
}

fn open(path: &Path) -> Result<(Reader, Header)> {
    let mut decoder = png::Decoder::new(read::open(path)?);
    // Any other choice expands a palette to colours or drops the low half of 16-bit ids.
    decoder.set_transformations(png::Transformations::IDENTITY);
    let reader = decoder.read_info().map_err(|error| unreadable(path, error))?;
    let info = reader.info();
    let header = Header { size: (info.width, info.height), colour: info.color_type, depth: info.bit_depth };
    check_size(path, header.size)?;
    check_png_length(path, header.size, header.colour.samples() as u32 * header.depth as u32)?;
    Ok((reader, header))
}

/// Reads the header of a PNG, and of the file no more than it takes.
pub(crate) fn read_header(path: &Path) -> Result<Header> {
    open(path).map(|(_, header)| header)
}

/// Reads a PNG of any kind, with `accept` asked about the header before a pixel is decoded.
pub(crate) fn read_raw(path: &Path, accept: impl FnOnce(&Header) -> Result<()>) -> Result<Raw> {
    let (mut reader, header) = open(path)?;
    accept(&header)?;
    let length = reader.output_buffer_size().ok_or_else(|| problem(path, "too large"))?;
    let mut bytes = vec![0; length];
    let frame = reader.next_frame(&mut bytes).map_err(|error| unreadable(path, error))?;
    Ok(Raw { header, bytes, line_size: frame.line_size })
}

/// Reads an id image: 8- or 16-bit grey, palette indices, or either with 1, 2 or 4 bits.
pub fn read_mask(path: impl AsRef<Path>) -> Result<LabelMap> {
    read_checked(path.as_ref(), |_| Ok(()))
}

/// Like [`read_mask`], with `accept` asked about the size before a pixel is decoded.
pub(crate) fn read_checked(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<LabelMap> {
    let raw = read_raw(path, |header| {
        if !matches!(header.colour, png::ColorType::Grayscale | png::ColorType::Indexed) {
            let text = format!(
                "a mask holds one id per pixel as grey value or palette index; this PNG is {:?}. Import the \
                 folder first: the import reads ids coded as R + 256 G + 65536 B; for display colours use \
                 the id image they were made from",
                header.colour
            );
            return Err(Error::data(path, "", text));
        }
        accept(header.size)
    })?;
    let (width, height) = raw.header.size;
    Ok(LabelMap { width, height, ids: raw.samples() })
}

/// The samples of one line.
fn unpack(line: &[u8], depth: png::BitDepth, width: usize) -> Vec<u16> {
    let packed = |bits: usize| {
        let per_byte = 8 / bits;
        let sample = move |x: usize| {
            let shift = 8 - bits * (x % per_byte + 1);
            u16::from(line[x / per_byte] >> shift) & ((1 << bits) - 1)
        };
        (0..width).map(sample).collect()
    };
    match depth {
        png::BitDepth::One => packed(1),
        png::BitDepth::Two => packed(2),
        png::BitDepth::Four => packed(4),
        png::BitDepth::Eight => line.iter().take(width).map(|&id| u16::from(id)).collect(),
        png::BitDepth::Sixteen => {
            line.chunks_exact(2).take(width).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
        }
    }
}

/// True if a mask of the size `found` can serve a photo of the size `photo`: it is a scaled one.
pub(crate) fn mask_size_fits(found: (u32, u32), photo: (u32, u32)) -> bool {
    same_aspect(found, photo)
}

/// Which names the mask of a photo may have.
pub(crate) struct PhotoNames {
    /// How many photos share a file stem; a flat folder serves only stems that are unique.
    stems: HashMap<String, usize>,
    /// How many share a path cut at the first dot of the file name, likewise.
    cut: HashMap<PathBuf, usize>,
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The path with the file name cut at its first dot, as Gaussian Grouping does.
fn cut_at_first_dot(name: &str) -> PathBuf {
    let path = Path::new(name);
    let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(file.split('.').next().unwrap_or_default())
}

impl PhotoNames {
    /// `names` are those of all photos of the scene.
    pub(crate) fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let (mut stems, mut cut) = (HashMap::new(), HashMap::new());
        for name in names {
            *stems.entry(stem(name)).or_insert(0) += 1;
            *cut.entry(cut_at_first_dot(name)).or_insert(0) += 1;
        }
        Self { stems, cut }
    }

    /// What the mask of `name` may be called, without `.png`, in order of preference: the photo's name without its
    /// extension, with it, cut at the first dot of the file name, and the first two without folders; the last three
    /// only where no other photo comes to the same name.
    pub(crate) fn keys(&self, name: &str) -> Vec<PathBuf> {
        let path = Path::new(name);
        let mut found = vec![path.with_extension(""), path.to_owned()];
        let cut = cut_at_first_dot(name);
        if self.cut.get(&cut) == Some(&1) {
            found.push(cut);
        }
        if self.stems.get(&stem(name)) == Some(&1) {
            found.push(stem(name).into());
            found.extend(path.file_name().map(PathBuf::from));
        }
        found
    }
}

/// `key` with `.png` added, whatever dots it has.
pub(crate) fn with_png(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".png");
    name.into()
}

/// Finds the mask of a photo by its name.
pub(crate) struct MaskFolder {
    folder: PathBuf,
    names: PhotoNames,
}

impl MaskFolder {
    /// `names` are those of all photos of the scene.
    pub(crate) fn new<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder of masks"));
        }
        Ok(Self { folder: folder.to_owned(), names: PhotoNames::new(names) })
    }

    /// The mask file of `name`, if there is one.
    pub(crate) fn find(&self, name: &str) -> Option<PathBuf> {
        self.names.keys(name).iter().map(|key| self.folder.join(with_png(key))).find(|path| path.is_file())
    }

    /// The error for a folder in which no photo has a mask.
    pub(crate) fn nothing_found(&self, name: &str) -> Error {
        let expected = Path::new(name).with_extension("png");
        let mut text = format!("no photo of the scene has a mask here; expected for example {}", expected.display());
        if ["jpg", "jpeg", "JPG"].iter().any(|ext| self.folder.join(expected.with_extension(ext)).is_file()) {
            text.push_str("; JPEG masks are refused because compression changes ids, write PNG");
        }
        Error::data(&self.folder, "", text)
    }
}
