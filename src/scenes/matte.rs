//! Photos of objects alone: masks as opacity.
//!
//! A mask says inside or outside, to a few pixels where a person drew it, and a photo mixes both at the edge. So the pixels
//! within a band along a contour are compared with the mean colours of both sides next to them: their place between the two is
//! the opacity, and what the surroundings add is taken off. Where both sides look alike, the distance from the contour is the
//! opacity. A step compares the result over a colour of its own ([`Photo::over`]).

use labelgs_scene::view::{ALPHA_CLEAR, alpha_of};
use labelgs_scene::{LabelMap, Photo};
use rayon::prelude::*;

/// Half the width of the band, as a share of the photo's longest side: contours that people draw are off by so much.
const BAND_SHARE: f64 = 1.0 / 400.0;
/// Reaches of the windows for the mean colours, in cells of a band's width: the first that has enough pixels counts.
const REACHES: [usize; 3] = [2, 6, 20];
/// Share of a window's pixels of a side that tell its colour.
const TOLD_SHARE: f64 = 0.02;
/// Distance of the two colours, 0 to 255 in each channel, from which they tell more of the opacity than the contour.
const CONTRAST: f64 = 40.0;

/// Leaves nothing of the photo but the objects of a mask, of any scale. Pixels without weight stay so.
pub fn cut_out(photo: &mut Photo, mask: &LabelMap) {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let band = ((f64::from(photo.width.max(photo.height)) * BAND_SHARE).round() as usize).max(1);
    let inside = of_photo(photo, mask);
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
            // Transparent photos tell their own edges.
            if texel[3] < u8::MAX { texel } else { edge(texel, soft(x, y), colours.around(x, y)) }
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

/// Returns a pixel of the band over black, with its opacity. `soft` is that by the contour alone; colours are those of the
/// surroundings and of the object nearby.
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
            let trust = square / (square + 3.0 * CONTRAST * CONTRAST);
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

/// Returns the mask at the size of the photo: 1 where it shows an object.
fn of_photo(photo: &Photo, mask: &LabelMap) -> LabelMap {
    let mut map = if (mask.width, mask.height) == (photo.width, photo.height) {
        mask.clone()
    } else {
        mask.resized(photo.width, photo.height)
    };
    map.ids.iter_mut().for_each(|id| *id = (*id).min(1));
    map
}

/// Sums of red, green, blue and number of pixels on both sides of the contours, outside and inside, without the band.
type Sums = [[u32; 4]; 2];

/// Mean colours on both sides of the contours, by squares of a photo.
struct Colours {
    side: usize,
    columns: usize,
    cells: Vec<Sums>,
}

impl Colours {
    fn new(photo: &Photo, inside: &LabelMap, near: &[bool], side: usize) -> Self {
        let (width, height) = (photo.width as usize, photo.height as usize);
        let columns = width.div_ceil(side);
        let mut cells = vec![Sums::default(); columns * height.div_ceil(side)];
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

    /// Returns the mean colours of the surroundings and of the object near a pixel; `None` without a pixel of them far around.
    fn around(&self, x: usize, y: usize) -> [Option<[f64; 3]>; 2] {
        let (x, y, rows) = (x / self.side, y / self.side, self.cells.len() / self.columns);
        [0, 1].map(|side| {
            REACHES.into_iter().find_map(|reach| {
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
                (told > 0.0 && told >= TOLD_SHARE * area).then(|| [r, g, b].map(|sum| sum / told))
            })
        })
    }
}
