//! Pixels of the images that pages show, and small encoded copies of them.

use image::imageops::{FilterType, resize};
use image::{ImageFormat, RgbImage};
use labelgs_files::image::jpeg_rgb8;
use labelgs_files::resize::bounded_size;
use labelgs_scene::colour::{HEAT_COLOURS, HEAT_MAX, colour_on_scale};
use labelgs_scene::{Error, Photo, Result};
use std::io::Cursor;

/// Longest side of an image inside a page, px.
pub const PANEL_SIDE_MAX: u32 = 800;
const JPEG_QUALITY: u8 = 85;

/// Returns the error of a render against its photo, the mean absolute difference of the channels, on the scale
/// [`HEAT_COLOURS`]; black where the photo has no pixel.
pub fn heat(photo: &Photo, rgb: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let of = |([r, g, b, valid], colour): (&[u8; 4], &[f32; 3])| {
        let difference = |value: f32, truth: u8| (value.clamp(0.0, 1.0) - f32::from(truth) / 255.0).abs();
        let sum = difference(colour[0], *r) + difference(colour[1], *g) + difference(colour[2], *b);
        if *valid == 0 { [0; 3] } else { colour_on_scale(&HEAT_COLOURS, sum / 3.0 / HEAT_MAX) }
    };
    photo.rgba.iter().zip(rgb).map(of).collect()
}

/// How a small copy is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Smooth images: JPEG.
    Smooth,
    /// Maps of few colours with sharp contours: PNG.
    Flat,
}

/// Encodes a copy whose longest side has at most `longest` px.
pub fn encoded((width, height): (u32, u32), pixels: &[[u8; 3]], kind: Kind, longest: u32) -> Result<Vec<u8>> {
    let broken = |text: String| Error::Bug(format!("a picture of a page: {text}"));
    let bytes = bytemuck::cast_slice(pixels).to_vec();
    let mut picture =
        RgbImage::from_raw(width, height, bytes).ok_or_else(|| broken("has too few pixels".to_owned()))?;
    let small = bounded_size((width, height), Some(longest));
    if small != (width, height) {
        let filter = if kind == Kind::Flat { FilterType::Nearest } else { FilterType::Triangle };
        picture = resize(&picture, small.0, small.1, filter);
    }
    match kind {
        Kind::Smooth => jpeg_rgb8(picture.dimensions(), picture.as_raw().as_chunks().0, JPEG_QUALITY),
        Kind::Flat => {
            let mut out = Cursor::new(Vec::new());
            picture.write_to(&mut out, ImageFormat::Png).map_err(|error| broken(error.to_string()))?;
            Ok(out.into_inner())
        }
    }
}
