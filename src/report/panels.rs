//! Pixels of the pictures that pages show, and small encoded copies of them.

use crate::error::{Error, Result};
use crate::scene::labels::label_colour;
use crate::scene::{LabelMap, Photo};
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};
use image::{ImageFormat, RgbImage};
use std::io::Cursor;

/// Longest side of a picture inside a page, px.
const LONGEST: u32 = 800;
const QUALITY: u8 = 85;

/// Returns a colour from 0 to 1 as bytes.
pub(crate) fn byte_colour(colour: [f32; 3]) -> [u8; 3] {
    colour.map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// Returns the colours of a photo.
pub(crate) fn photo_pixels(photo: &Photo) -> Vec<[u8; 3]> {
    photo.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}

/// Returns the absolute difference of a render and its photo.
pub(crate) fn difference(photo: &Photo, rgb: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let of = |([r, g, b, _], &found): (&[u8; 4], &[f32; 3])| {
        let found = byte_colour(found);
        [found[0].abs_diff(*r), found[1].abs_diff(*g), found[2].abs_diff(*b)]
    };
    photo.rgba.iter().zip(rgb).map(of).collect()
}

/// Returns a difference that is easier to see.
pub(crate) fn brighter(difference: &[[u8; 3]], times: u8) -> Vec<[u8; 3]> {
    difference.iter().map(|colour| colour.map(|value| value.saturating_mul(times))).collect()
}

/// Returns the display colours of a map of labels.
pub(crate) fn label_pixels(map: &LabelMap) -> Vec<[u8; 3]> {
    map.ids.iter().map(|&id| label_colour(u32::from(id))).collect()
}

/// How a small copy is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Smooth pictures: JPEG.
    Smooth,
    /// Maps of few colours with sharp contours: PNG.
    Flat,
}

/// Encodes a copy that fits into a page.
pub(crate) fn encoded((width, height): (u32, u32), pixels: &[[u8; 3]], kind: Kind) -> Result<Vec<u8>> {
    let broken = |text: String| Error::Bug(format!("a picture of a page: {text}"));
    let bytes = bytemuck::cast_slice(pixels).to_vec();
    let mut picture =
        RgbImage::from_raw(width, height, bytes).ok_or_else(|| broken("has too few pixels".to_owned()))?;
    let longest = width.max(height);
    if longest > LONGEST {
        let side = |side: u32| (u64::from(side) * u64::from(LONGEST) / u64::from(longest)).max(1) as u32;
        let filter = if kind == Kind::Flat { FilterType::Nearest } else { FilterType::Triangle };
        picture = resize(&picture, side(width), side(height), filter);
    }
    let mut out = Cursor::new(Vec::new());
    let done = match kind {
        Kind::Smooth => picture.write_with_encoder(JpegEncoder::new_with_quality(&mut out, QUALITY)),
        Kind::Flat => picture.write_to(&mut out, ImageFormat::Png),
    };
    done.map_err(|error| broken(error.to_string()))?;
    Ok(out.into_inner())
}
