//! Panes of a frame: parts of a render as PNG or JPEG.

use super::message::Pane;
use crate::error::Result;
use crate::files::image::{jpeg_rgb8, png_grey16, png_rgb8};
use crate::render::pictures::{depth_preview, to_word};
use crate::render::{Parts, Render};
use crate::scene::colour::{HEAT_COLOURS, HEAT_MAX, colour_on_scale, to_byte};
use crate::scene::labels::{label_colour, label_colours};
use crate::scene::{Photo, UNLABELLED};

/// Share of the label's colour in labels over colour.
const LABEL_TINT_SHARE: f32 = 0.55;
/// Quality of JPEGs, for moving images on slow lines.
const JPEG_QUALITY: u8 = 70;

/// Colours of no to full confidence.
const CONFIDENCE_COLOURS: [[u8; 3]; 3] = [[214, 47, 39], [253, 219, 124], [26, 150, 84]];

/// Data that panes need besides the render.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PanelData<'a> {
    /// Confidence by row of the drawn model.
    pub(super) confidence: Option<&'a [f32]>,
    /// Photo of the view.
    pub(super) photo: Option<&'a Photo>,
}

/// Returns the parts of a render that panes need.
pub(super) fn parts(panes: &[Pane]) -> Parts {
    let asked = |of: &[Pane]| panes.iter().any(|pane| of.contains(pane));
    Parts {
        depth: asked(&[Pane::Depth]),
        main: asked(&[Pane::Confidence]),
        labels: asked(&[Pane::Labels, Pane::Tinted]),
    }
}

/// Returns the bytes of the image of a pane. Colour, labels, depth and opacity have the pixels that `render` writes.
pub(super) fn encode(pane: Pane, rendered: &Render, beside: PanelData, is_lossy: bool) -> Result<Vec<u8>> {
    let size = (rendered.width, rendered.height);
    match pane {
        Pane::Depth => return png_grey16(size, &depth_preview(&rendered.depth)),
        Pane::Opacity => {
            let words: Vec<u16> = rendered.alpha.iter().map(|&value| to_word(value)).collect();
            return png_grey16(size, &words);
        }
        _ => {}
    }
    let pixels: Vec<[u8; 3]> = match pane {
        Pane::Labels => label_colours(&rendered.labels),
        Pane::Tinted => rendered.rgb.iter().zip(&rendered.labels).map(tinted).collect(),
        Pane::Confidence => rendered.top_id.iter().map(|&row| confidence(row, beside.confidence)).collect(),
        Pane::Error => errors(rendered, beside.photo),
        _ => rendered.rgb.iter().map(|colour| colour.map(to_byte)).collect(),
    };
    if is_lossy { jpeg_rgb8(size, &pixels, JPEG_QUALITY) } else { png_rgb8(size, &pixels) }
}

/// Returns the label of each pixel as a PNG: its bytes from the lowest on are red, green and blue.
pub(super) fn label_map(rendered: &Render) -> Result<Vec<u8>> {
    let pixels: Vec<[u8; 3]> = rendered.labels.iter().map(|id| [0, 8, 16].map(|shift| (id >> shift) as u8)).collect();
    png_rgb8((rendered.width, rendered.height), &pixels)
}

fn tinted((colour, &id): (&[f32; 3], &u32)) -> [u8; 3] {
    if id == UNLABELLED {
        return colour.map(to_byte);
    }
    let label = label_colour(id).map(|byte| f32::from(byte) / 255.0);
    [0, 1, 2].map(|c| to_byte(colour[c].clamp(0.0, 1.0) * (1.0 - LABEL_TINT_SHARE) + label[c] * LABEL_TINT_SHARE))
}

fn confidence(row: i32, known: Option<&[f32]>) -> [u8; 3] {
    let row = usize::try_from(row).ok();
    row.and_then(|row| known?.get(row)).map_or([0; 3], |&share| colour_on_scale(&CONFIDENCE_COLOURS, share))
}

/// Mean difference of the channels; black where the photo has no pixel. A smaller render takes the pixel of the photo
/// in the same place.
fn errors(rendered: &Render, photo: Option<&Photo>) -> Vec<[u8; 3]> {
    let Some(photo) = photo else { return vec![[0; 3]; rendered.rgb.len()] };
    let (width, height) = (rendered.width, rendered.height);
    let pixel = |(index, colour): (usize, &[f32; 3])| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let place = |at: u32, of: u32, all: u32| (u64::from(at) * u64::from(all) / u64::from(of)) as u32;
        let at = place(y, height, photo.height) * photo.width + place(x, width, photo.width);
        let [r, g, b, valid] = photo.rgba[at as usize];
        if valid == 0 {
            return [0; 3];
        }
        let of = |value: f32, truth: u8| (value.clamp(0.0, 1.0) - f32::from(truth) / 255.0).abs();
        colour_on_scale(&HEAT_COLOURS, (of(colour[0], r) + of(colour[1], g) + of(colour[2], b)) / 3.0 / HEAT_MAX)
    };
    rendered.rgb.iter().enumerate().map(pixel).collect()
}
