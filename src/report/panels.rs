//! Pixels of the pictures that pages show, and small encoded copies of them.

use image::imageops::{FilterType, resize};
use image::{ImageFormat, RgbImage};
use labelgs_files::image::jpeg_rgb8;
use labelgs_files::resize::bounded_size;
use labelgs_scene::colour::to_byte;
use labelgs_scene::{Error, Photo, Result};
use std::io::Cursor;

/// Longest side of a picture inside a page, px.
const LONGEST: u32 = 800;
const QUALITY: u8 = 85;

/// Returns the absolute difference of a render and its photo.
pub fn difference(photo: &Photo, rgb: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let of = |([r, g, b, _], &found): (&[u8; 4], &[f32; 3])| {
        let found = found.map(to_byte);
        [found[0].abs_diff(*r), found[1].abs_diff(*g), found[2].abs_diff(*b)]
    };
    photo.rgba.iter().zip(rgb).map(of).collect()
}

/// Returns a difference that is easier to see.
pub fn brighter(difference: &[[u8; 3]], times: u8) -> Vec<[u8; 3]> {
    difference.iter().map(|colour| colour.map(|value| value.saturating_mul(times))).collect()
}

/// How a small copy is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Smooth pictures: JPEG.
    Smooth,
    /// Maps of few colours with sharp contours: PNG.
    Flat,
}

/// Encodes a copy that fits into a page.
pub fn encoded((width, height): (u32, u32), pixels: &[[u8; 3]], kind: Kind) -> Result<Vec<u8>> {
    let broken = |text: String| Error::Bug(format!("a picture of a page: {text}"));
    let bytes = bytemuck::cast_slice(pixels).to_vec();
    let mut picture =
        RgbImage::from_raw(width, height, bytes).ok_or_else(|| broken("has too few pixels".to_owned()))?;
    let small = bounded_size((width, height), Some(LONGEST));
    if small != (width, height) {
        let filter = if kind == Kind::Flat { FilterType::Nearest } else { FilterType::Triangle };
        picture = resize(&picture, small.0, small.1, filter);
    }
    match kind {
        Kind::Smooth => jpeg_rgb8(picture.dimensions(), picture.as_raw().as_chunks().0, QUALITY),
        Kind::Flat => {
            let mut out = Cursor::new(Vec::new());
            picture.write_to(&mut out, ImageFormat::Png).map_err(|error| broken(error.to_string()))?;
            Ok(out.into_inner())
        }
    }
}
