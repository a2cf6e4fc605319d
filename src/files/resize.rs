//! Downscales photos: each pixel is an exact area mean.

use labelgs_scene::Photo;
use rayon::prelude::*;

/// Limits a size to `longest` px on its longest side. Cameras, photos and masks all round by this rule.
pub fn bounded_size((width, height): (u32, u32), longest: Option<u32>) -> (u32, u32) {
    let Some(longest) = longest.filter(|&longest| longest < width.max(height)) else { return (width, height) };
    let scale = f64::from(longest) / f64::from(width.max(height));
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (side(width), side(height))
}

/// Returns true if the sizes differ only by scale: the larger one shrunk to the smaller agrees within 1 px.
pub fn same_aspect(a: (u32, u32), b: (u32, u32)) -> bool {
    let along = |from: (u32, u32), to: (u32, u32)| {
        let height = f64::from(from.1) * f64::from(to.0) / f64::from(from.0);
        let width = f64::from(from.0) * f64::from(to.1) / f64::from(from.1);
        (height - f64::from(to.1)).abs() <= 1.0 || (width - f64::from(to.0)).abs() <= 1.0
    };
    let smaller_first = u64::from(a.0) * u64::from(a.1) <= u64::from(b.0) * u64::from(b.1);
    if smaller_first { along(b, a) } else { along(a, b) }
}

/// Returns the message for an image that no scale brings to the size of another. Each size comes with a name.
pub fn aspect_problem((what, size): (&str, (u32, u32)), (of, other): (&str, (u32, u32))) -> Option<String> {
    let text = || {
        let ((width, height), (other_width, other_height)) = (size, other);
        format!("{what} has {width} x {height} px and {of} {other_width} x {other_height} px, which no scale explains")
    };
    (size.0 == 0 || size.1 == 0 || !same_aspect(size, other)).then(text)
}

/// Returns the first source pixel of each target pixel along one side, and the weights from there on, with sum 1.
fn spans(from: u32, to: u32) -> Vec<(usize, Vec<f64>)> {
    let ratio = f64::from(from) / f64::from(to);
    let span = |index: u32| {
        let (start, end) = (f64::from(index) * ratio, f64::from(index + 1) * ratio);
        let first = start.floor();
        let last = (end.ceil().min(f64::from(from)) as u32).max(first as u32 + 1);
        let overlap = |pixel: u32| (end.min(f64::from(pixel + 1)) - start.max(f64::from(pixel))).max(0.0) / ratio;
        (first as usize, (first as u32..last).map(overlap).collect())
    };
    (0..to).map(span).collect()
}

/// Shrinks the photo to `width` x `height` px. Each target pixel is the exact area mean over the source pixels with
/// weight. The target pixel has weight if they cover at least half of its area.
pub fn shrink_photo(photo: &Photo, width: u32, height: u32) -> Photo {
    if (width, height) == (photo.width, photo.height) {
        return photo.clone();
    }
    let (columns, rows) = (spans(photo.width, width), spans(photo.height, height));
    let row = |(top, weights): &(usize, Vec<f64>)| -> Vec<[u8; 4]> {
        columns.iter().map(|(left, across)| mean(photo, (*left, across), (*top, weights))).collect()
    };
    let rgba = rows.par_iter().flat_map_iter(row).collect();
    Photo { width, height, rgba }
}

fn mean(photo: &Photo, (left, across): (usize, &[f64]), (top, down): (usize, &[f64])) -> [u8; 4] {
    let (mut sum, mut covered) = ([0.0f64; 4], 0.0);
    for (y, weight_y) in down.iter().enumerate() {
        let start = (top + y) * photo.width as usize + left;
        for (texel, weight_x) in photo.rgba[start..start + across.len()].iter().zip(across) {
            let weight = if texel[3] >= 128 { weight_x * weight_y } else { 0.0 };
            covered += weight;
            (0..4).for_each(|channel| sum[channel] += weight * f64::from(texel[channel]));
        }
    }
    if covered < 0.5 - 1e-9 {
        return [0; 4];
    }
    sum.map(|value| (value / covered).round().clamp(0.0, 255.0) as u8)
}
