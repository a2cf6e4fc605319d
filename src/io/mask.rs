//! Id masks: the object at each pixel of a photo.
//!
//! The pixel value is the id, and 0 is unlabelled. The file is a grey PNG of any depth, or a palette PNG, whose *index*
//! is the id. Colours never become ids: two palette entries may share a colour, and a colour code needs its legend.

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
        // A truncated file ends early. A failing disk reports another error.
        DecodingError::IoError(cause) if cause.kind() != ErrorKind::UnexpectedEof => Error::read(path)(cause),
        other => problem(path, other),
    }
}

fn problem(path: &Path, problem: impl std::fmt::Display) -> Error {
    Error::data(path, "", format!("is no readable PNG: {problem}; write the file again"))
}

/// The header of a PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    /// Width and height, px.
    pub(crate) size: (u32, u32),
    pub(crate) colour: png::ColorType,
    /// Bits per sample.
    pub(crate) depth: png::BitDepth,
}

/// A PNG with its samples as stored.
pub(crate) struct Raw {
    pub(crate) header: Header,
    bytes: Vec<u8>,
    line_size: usize,
}

impl Raw {
    /// Returns all samples, row-major, channels interleaved.
    pub(crate) fn samples(&self) -> Vec<u16> {
        let Header { size, colour, depth } = self.header;
        let per_line = size.0 as usize * colour.samples();
        let lines = self.bytes.chunks_exact(self.line_size).take(size.1 as usize);
        lines.flat_map(|line| unpack(line, depth, per_line)).collect()
    }
}

fn open(path: &Path) -> Result<(Reader, Header)> {
    let mut decoder = png::Decoder::new(read::open(path)?);
    // Other settings expand a palette to colours or drop the low byte of 16-bit ids.
    decoder.set_transformations(png::Transformations::IDENTITY);
    let reader = decoder.read_info().map_err(|error| unreadable(path, error))?;
    let info = reader.info();
    let header = Header { size: (info.width, info.height), colour: info.color_type, depth: info.bit_depth };
    check_size(path, header.size)?;
    check_png_length(path, header.size, header.colour.samples() as u32 * header.depth as u32)?;
    Ok((reader, header))
}

/// Reads only the header of a PNG.
pub(crate) fn read_header(path: &Path) -> Result<Header> {
    open(path).map(|(_, header)| header)
}

/// Reads a PNG of any kind. `accept` checks the header before decoding.
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

/// Like [`read_mask`]; `accept` checks the size before decoding.
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

/// Reads a picture of what to ignore, a PNG of any kind: 1 where a colour or a palette index is not 0, which black is.
/// `accept` checks the size before decoding.
pub(crate) fn read_ignored(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<LabelMap> {
    let raw = read_raw(path, |header| accept(header.size))?;
    let Header { size: (width, height), colour, .. } = raw.header;
    // Opacity, the last of two or four channels, says nothing.
    let colours = colour.samples() - usize::from(colour.samples() % 2 == 0);
    let is_ignored = |pixel: &[u16]| u16::from(pixel[..colours].iter().any(|&value| value != 0));
    Ok(LabelMap { width, height, ids: raw.samples().chunks_exact(colour.samples()).map(is_ignored).collect() })
}

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

/// Returns true if a mask of size `found` can serve a photo of size `photo`: they differ by a scale only.
pub(crate) fn mask_size_fits(found: (u32, u32), photo: (u32, u32)) -> bool {
    same_aspect(found, photo)
}

/// The possible names for the mask of a photo.
pub(crate) struct PhotoNames {
    /// Number of photos per file stem. A flat folder serves only unique stems.
    stems: HashMap<String, usize>,
    /// Number of photos per path cut at the first dot of the file name, for the same reason.
    cut: HashMap<PathBuf, usize>,
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Cuts the file name of a path at its first dot, as Gaussian Grouping does.
fn cut_at_first_dot(name: &str) -> PathBuf {
    let path = Path::new(name);
    let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(file.split('.').next().unwrap_or_default())
}

impl PhotoNames {
    /// Makes it from the names of all photos of the scene.
    pub(crate) fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let (mut stems, mut cut) = (HashMap::new(), HashMap::new());
        for name in names {
            *stems.entry(stem(name)).or_insert(0) += 1;
            *cut.entry(cut_at_first_dot(name)).or_insert(0) += 1;
        }
        Self { stems, cut }
    }

    /// Returns the possible names for the mask of `name`, without `.png`, in order of preference: the photo's name
    /// without its extension, with it, cut at the first dot of the file name, and the first two without folders. The
    /// last three need a name that no other photo shares.
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

/// Appends `.png` to `key`, which may contain dots.
pub(crate) fn with_png(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".png");
    name.into()
}

/// A folder of masks that are found by the name of the photo.
pub(crate) struct MaskFolder {
    folder: PathBuf,
    names: PhotoNames,
}

impl MaskFolder {
    /// Opens the folder; `names` are those of all photos of the scene.
    pub(crate) fn new<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder"));
        }
        Ok(Self { folder: folder.to_owned(), names: PhotoNames::new(names) })
    }

    /// Returns the mask file of `name`, if there is one.
    pub(crate) fn find(&self, name: &str) -> Option<PathBuf> {
        self.names.keys(name).iter().map(|key| self.folder.join(with_png(key))).find(|path| path.is_file())
    }

    /// Makes the error for a folder without a mask for any photo.
    pub(crate) fn nothing_found(&self, name: &str) -> Error {
        let expected = Path::new(name).with_extension("png");
        let mut text = format!("has a PNG for no photo of the scene; expected for example {}", expected.display());
        if ["jpg", "jpeg", "JPG"].iter().any(|ext| self.folder.join(expected.with_extension(ext)).is_file()) {
            text.push_str("; JPEG is refused because compression changes ids, write PNG");
        }
        Error::data(&self.folder, "", text)
    }
}
