//! Id masks: the object at each pixel of a photo.
//!
//! The pixel value is the id; 0 is unlabelled. The file is a grey PNG of any depth, even if stored as colour, or a
//! palette PNG whose *index* is the id. Colours never become ids: two palette entries may share a colour, and a colour
//! code needs its legend.

use labelgs_files::image::{check_png_length, check_size};
use labelgs_files::read;
use labelgs_scene::{Error, LabelMap, Result};
use png::DecodingError;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;

/// First bytes of a JPEG.
const JPEG_START: &[u8] = &[0xff, 0xd8, 0xff];

type Reader = png::Reader<BufReader<read::Source>>;

fn unreadable(path: &Path, error: DecodingError) -> Error {
    match error {
        // A truncated file ends early. A failing disk reports another error.
        DecodingError::IoError(cause) if cause.kind() != ErrorKind::UnexpectedEof => Error::read(path)(cause),
        other => problem(path, other),
    }
}

fn problem(path: &Path, problem: impl std::fmt::Display) -> Error {
    Error::data(path, "", format!("is not a readable PNG: {problem}; write the file again"))
}

/// The header of a PNG.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Width and height, px.
    pub size: (u32, u32),
    /// Channels.
    pub colour: png::ColorType,
    /// Bits per sample.
    pub depth: png::BitDepth,
}

/// A PNG with its samples as stored.
pub struct RawPng {
    /// Size, channels and bits.
    pub header: Header,
    bytes: Vec<u8>,
    line_size: usize,
}

impl RawPng {
    /// Returns all samples, row-major, channels interleaved.
    pub fn samples(&self) -> Vec<u16> {
        let Header { size, colour, depth } = self.header;
        let per_line = size.0 as usize * colour.samples();
        let lines = self.bytes.chunks_exact(self.line_size).take(size.1 as usize);
        lines.flat_map(|line| unpack(line, depth, per_line)).collect()
    }

    /// Returns all samples without opacity, and the number of channels. Errors if a coloured pixel is transparent,
    /// because it is unclear whether such a pixel belongs to the object.
    pub fn opaque(&self, path: &Path) -> Result<(Vec<u16>, usize)> {
        let (mut samples, channels) = (self.samples(), self.header.colour.samples());
        if channels % 2 == 1 {
            return Ok((samples, channels));
        }
        let full = ((1_u32 << (self.header.depth as u32)) - 1) as u16;
        let pixels = || samples.chunks_exact(channels).map(|pixel| pixel.split_at(channels - 1));
        let is_black = |colour: &[u16]| colour.iter().all(|&value| value == 0);
        if pixels().any(|(colour, alpha)| alpha[0] != full && !is_black(colour)) {
            let problem = "has transparent pixels that are not black, which may or may not belong to an object; write the \
                           mask without transparency";
            return Err(Error::data(path, "", problem));
        }
        let is_hidden = pixels().all(|(colour, _)| is_black(colour))
            && pixels().any(|(_, alpha)| alpha[0] != samples[channels - 1]);
        if is_hidden {
            let problem = "is black everywhere and only its opacity differs; save the opacity as a grey image";
            return Err(Error::data(path, "", problem));
        }
        let mut at = 0;
        samples.retain(|_| {
            at += 1;
            at % channels != 0
        });
        Ok((samples, channels - 1))
    }

    /// Returns a single value per pixel: grey, palette index, or equal colour channels. `None` for other colours.
    pub fn values(&self, path: &Path) -> Result<Option<Vec<u16>>> {
        let (samples, channels) = self.opaque(path)?;
        if channels == 1 {
            return Ok(Some(samples));
        }
        let mut pixels = samples.chunks_exact(channels);
        let is_grey = pixels.clone().all(|pixel| pixel.iter().all(|value| *value == pixel[0]));
        Ok(is_grey.then(|| pixels.by_ref().map(|pixel| pixel[0]).collect()))
    }
}

fn open(path: &Path) -> Result<(Reader, Header)> {
    let mut file = read::open(path)?;
    if file.fill_buf().map_err(Error::read(path))?.starts_with(JPEG_START) {
        let problem = "is a JPEG, whose compression changes ids; make the masks again as PNG";
        return Err(Error::data(path, "", problem));
    }
    let mut decoder = png::Decoder::new(file);
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
pub fn read_header(path: &Path) -> Result<Header> {
    open(path).map(|(_, header)| header)
}

/// Reads a PNG of any kind. `accept` checks the header before decoding.
pub fn read_raw(path: &Path, accept: impl FnOnce(&Header) -> Result<()>) -> Result<RawPng> {
    let (mut reader, header) = open(path)?;
    accept(&header)?;
    let length = reader.output_buffer_size().ok_or_else(|| problem(path, "too large"))?;
    let mut bytes = vec![0; length];
    let frame = reader.next_frame(&mut bytes).map_err(|error| unreadable(path, error))?;
    Ok(RawPng { header, bytes, line_size: frame.line_size })
}

/// Reads an id image: 8 or 16-bit grey, palette indices, either with 1, 2 or 4 bits, or colours with equal channels.
/// Opacity must carry no information.
pub fn read_mask(path: impl AsRef<Path>) -> Result<LabelMap> {
    read_checked(path.as_ref(), |_| Ok(()))
}

/// Like [`read_mask`]; `accept` checks the size before decoding.
pub fn read_checked(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<LabelMap> {
    let raw = read_raw(path, |header| accept(header.size))?;
    let Some(ids) = raw.values(path)? else {
        let text = format!(
            "a mask holds one id per pixel as grey value or palette index, but this PNG is {:?} with colours. Import \
             the folder first: the import reads ids coded as R + 256 G + 65536 B; for display colours use \
             the id image they were made from",
            raw.header.colour
        );
        return Err(Error::data(path, "", text));
    };
    let (width, height) = raw.header.size;
    Ok(LabelMap { width, height, ids })
}

/// Reads a picture of what to ignore, a PNG of any kind: 1 where a colour or a palette index is not 0, which black is.
/// Reads an ignore mask, a PNG of any kind: 1 where a colour channel or the palette index is not 0.
pub fn read_ignored(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<LabelMap> {
    let raw = read_raw(path, |header| accept(header.size))?;
    let Header { size: (width, height), colour, .. } = raw.header;
    // Opacity, the last of two or four channels, is ignored.
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
