//! Photos of isolated objects: masks as opacity.
//!
//! A mask distinguishes inside and outside, within a few pixels if drawn by hand, and a photo mixes both at the edge.
//! So the pixels within a band along a contour are compared with the mean colours next to them on both sides. Their
//! position between the two colours is the opacity, and the contribution of the surroundings is removed. If both sides
//! look alike, the distance from the contour determines the opacity. A training step compares the result over its own
//! background colour ([`Photo::over`]).

use labelgs_scene::view::{ALPHA_CLEAR, alpha_of};
use labelgs_scene::{LabelMap, Photo};
use rayon::prelude::*;

/// Half the width of the band, as a share of the photo's longest side: hand-drawn contours are off by this much.
const BAND_SHARE: f64 = 1.0 / 400.0;
/// Radii of the windows for the mean colours, in cells of a band's width: the first with enough pixels is used.
const WINDOW_RADII: [usize; 3] = [2, 6, 20];
/// Smallest share of a window's pixels that must be on a side for its colour to be used.
const SIDE_SHARE_MIN: f64 = 0.02;
/// Colour distance, 0 to 255 per channel, above which colours determine the opacity more than the contour.
const CONTRAST_MIN: f64 = 40.0;

/// Removes everything from the photo except the objects of a mask, of any scale. Invalid pixels stay invalid.
pub fn cut_out(photo: &mut Photo, mask: &LabelMap) {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let band = ((f64::from(photo.width.max(photo.height)) * BAND_SHARE).round() as usize).max(1);
    let inside = scaled_mask(photo, mask);
    let near = inside.near_contour(band as u32);
    let colours = Colours::new(photo, &inside, &near, 2 * band);
    let soft = |x: usize, y: usize| {
        let (left, right) = (x.saturating_sub(band), (x + band + 1).min(width));
        let rows = y.saturating_sub(band)..(y + band + 1).min(height);
        let area = (right - left) * rows.len();
        let count: usize =
            rows.map(|y| inside.ids[y * width + left..y * width + right].iter().filter(|&&id| id != 0).count()).sum();
        count as f64 / area as f64
    };
    let edges: Vec<[u8; 4]> = (0..width * height)
        .into_par_iter()
        .filter(|&at| near[at])
        .map(|at| {
            let (texel, (x, y)) = (photo.rgba[at], (at % width, at / width));
            // Transparent photos have their own edges.
            if texel[3] < u8::MAX { texel } else { edge(texel, soft(x, y), colours.mean_colours(x, y)) }
        })
        .collect();
    let mut edges = edges.into_iter();
    for (at, texel) in photo.rgba.iter_mut().enumerate() {
        if near[at] {
            *texel = edges.next().unwrap_or_default();
        } else if inside.ids[at] == 0 && texel[3] >= ALPHA_CLEAR {
            *texel = [0, 0, 0, ALPHA_CLEAR];
        }
        if texel[3] < ALPHA_CLEAR {
            *texel = [0; 4];
        }
    }
}

/// Returns a pixel of the band over black, with its opacity. `soft` is the opacity by the contour alone; the colours
/// are those of the nearby surroundings and object.
fn edge([r, g, b, _]: [u8; 4], soft: f64, [surroundings, object]: [Option<[f64; 3]>; 2]) -> [u8; 4] {
    let colour = [r, g, b].map(f64::from);
    let Some(behind) = surroundings else { return [r, g, b, u8::MAX] };
    let opacity = match object {
        Some(object) => {
            let (mut along, mut square) = (0.0, 0.0);
            for channel in 0..3 {
                let way = object[channel] - behind[channel];
                along += (colour[channel] - behind[channel]) * way;
                square += way * way;
            }
            let trust = square / (square + 3.0 * CONTRAST_MIN * CONTRAST_MIN);
            let told = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { soft };
            soft + trust * (told - soft)
        }
        None => soft,
    };
    let of_object = |channel: usize| {
        let own = colour[channel] - (1.0 - opacity) * behind[channel];
        own.clamp(0.0, 255.0 * opacity).round() as u8
    };
    [of_object(0), of_object(1), of_object(2), alpha_of(opacity)]
}

/// Returns the mask at the size of the photo: 1 for objects.
fn scaled_mask(photo: &Photo, mask: &LabelMap) -> LabelMap {
    let mut map = if (mask.width, mask.height) == (photo.width, photo.height) {
        mask.clone()
    } else {
        mask.resized(photo.width, photo.height)
    };
    map.ids.iter_mut().for_each(|id| *id = (*id).min(1));
    map
}

/// Sums of red, green, blue and number of pixels on both sides of the contours, outside and inside, excluding the band.
type SideSums = [[u32; 4]; 2];

/// Mean colours on both sides of the contours, in cells of a photo.
struct Colours {
    side: usize,
    columns: usize,
    cells: Vec<SideSums>,
}

impl Colours {
    fn new(photo: &Photo, inside: &LabelMap, near: &[bool], side: usize) -> Self {
        let (width, height) = (photo.width as usize, photo.height as usize);
        let columns = width.div_ceil(side);
        let mut cells = vec![SideSums::default(); columns * height.div_ceil(side)];
        for y in 0..height {
            let row = y * width..(y + 1) * width;
            let texels = photo.rgba[row.clone()].chunks(side).zip(inside.ids[row.clone()].chunks(side));
            let squares = cells[y / side * columns..].iter_mut();
            for (((texels, ids), near), cell) in texels.zip(near[row].chunks(side)).zip(squares) {
                for ((&[r, g, b, alpha], &id), &near) in texels.iter().zip(ids).zip(near) {
                    if alpha == u8::MAX && !near {
                        let sums = &mut cell[usize::from(id)];
                        sums[0] += u32::from(r);
                        sums[1] += u32::from(g);
                        sums[2] += u32::from(b);
                        sums[3] += 1;
                    }
                }
            }
        }
        Self { side, columns, cells }
    }

    /// Returns the mean colours of the surroundings and of the object near a pixel; `None` if there are too few pixels
    /// far around.
    fn mean_colours(&self, x: usize, y: usize) -> [Option<[f64; 3]>; 2] {
        let (x, y, rows) = (x / self.side, y / self.side, self.cells.len() / self.columns);
        [0, 1].map(|side| {
            WINDOW_RADII.into_iter().find_map(|reach| {
                let columns = x.saturating_sub(reach)..(x + reach + 1).min(self.columns);
                let mut sums = [0_u32; 4];
                let mut count = 0;
                for row in y.saturating_sub(reach)..(y + reach + 1).min(rows) {
                    for cell in &self.cells[row * self.columns..][columns.clone()] {
                        (0..4).for_each(|channel| sums[channel] += cell[side][channel]);
                        count += 1;
                    }
                }
                let [r, g, b, told] = sums.map(f64::from);
                let area = (count * self.side * self.side) as f64;
                (told > 0.0 && told >= SIDE_SHARE_MIN * area).then(|| [r, g, b].map(|sum| sum / told))
            })
        })
    }
}
