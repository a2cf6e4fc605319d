//! The images of a SOG.

use crate::archive::Archive;
use image_webp::{ColorType, WebPDecoder, WebPEncoder};
use labelgs_scene::{Error, Result};
use std::io::{self, Cursor};

/// Most samples per byte of an image, and an allowance: images of a single colour take few bytes.
const SAMPLES_PER_BYTE_MAX: u64 = 8192;
const EXTRA_SAMPLES_MAX: u64 = 1 << 22;
/// Longest side of an image.
const SIDE_MAX: u32 = 16_383;

/// An RGBA image.
pub(super) struct Image {
    pub(super) width: usize,
    pub(super) texels: Vec<[u8; 4]>,
}

/// Decodes an image of an archive.
pub(super) fn picture(archive: &mut Archive, name: &str) -> Result<Image> {
    let bytes = archive.file(name)?;
    let bad = |problem: String| Error::data(archive.path(), name, format!("{problem}; export the file again"));
    let broken = |error: image_webp::DecodingError| bad(format!("is not a WebP image: {error}"));
    let mut decoder = WebPDecoder::new(Cursor::new(&bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let samples = 4 * u64::from(width) * u64::from(height);
    if width.max(height) > SIDE_MAX || samples > EXTRA_SAMPLES_MAX + SAMPLES_PER_BYTE_MAX * bytes.len() as u64 {
        return Err(bad(format!("is {width} x {height} in {} bytes, more than they can hold", bytes.len())));
    }
    if decoder.is_animated() {
        return Err(bad("is animated; expected a single image".into()));
    }
    let size = decoder.output_buffer_size().ok_or_else(|| bad(format!("is {width} x {height}, too large")))?;
    let mut pixels = vec![0; size];
    decoder.read_image(&mut pixels).map_err(broken)?;
    let texels = if decoder.has_alpha() {
        pixels.as_chunks::<4>().0.to_vec()
    } else {
        pixels.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect()
    };
    Ok(Image { width: width as usize, texels })
}

/// Encodes an image of this width losslessly; missing pixels at the end are 0.
pub(super) fn encode(texels: &[[u8; 4]], width: usize, height: usize) -> io::Result<Vec<u8>> {
    let mut pixels = texels.as_flattened().to_vec();
    pixels.resize(4 * width * height, 0);
    let mut bytes = Vec::new();
    let encoder = WebPEncoder::new(&mut bytes);
    encoder.encode(&pixels, width as u32, height as u32, ColorType::Rgba8).map_err(io::Error::other)?;
    Ok(bytes)
}
