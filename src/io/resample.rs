//! Photos and id maps at another size or through another lens.
//!
//! Photos are undistorted at their own size with bilinear interpolation, then shrunk by an exact area average. Ids are
//! never mixed: each target pixel takes the id at its centre, with size and lens in one step.

use super::lens::{Distortion, Lens};
use crate::scene::{Camera, LabelMap, Photo};
use glam::DVec2;
use rayon::prelude::*;

/// Returns the size limited to `longest` px at the longest side. It is the only rounding rule for cameras, photos and
/// masks.
pub(crate) fn bounded_size((width, height): (u32, u32), longest: Option<u32>) -> (u32, u32) {
    let Some(longest) = longest.filter(|&longest| longest < width.max(height)) else { return (width, height) };
    let scale = f64::from(longest) / f64::from(width.max(height));
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (side(width), side(height))
}

/// Returns true if the sizes differ by a scale only: the larger one shrunk to the smaller agrees within 1 px.
pub(crate) fn same_aspect(a: (u32, u32), b: (u32, u32)) -> bool {
    let along = |from: (u32, u32), to: (u32, u32)| {
        let height = f64::from(from.1) * f64::from(to.0) / f64::from(from.0);
        let width = f64::from(from.0) * f64::from(to.1) / f64::from(from.1);
        (height - f64::from(to.1)).abs() <= 1.0 || (width - f64::from(to.0)).abs() <= 1.0
    };
    let smaller_first = u64::from(a.0) * u64::from(a.1) <= u64::from(b.0) * u64::from(b.1);
    if smaller_first { along(b, a) } else { along(a, b) }
}

/// A map from pixels of the pinhole image of `camera` to the photo through `lens` with the same intrinsics.
pub(crate) struct Undistortion<'a> {
    camera: &'a Camera,
    /// The lens, and the radius up to which it is one to one.
    lens: Option<(&'a dyn Distortion, f64)>,
}

impl<'a> Undistortion<'a> {
    /// Makes the map; `camera` has the size of the photo.
    pub(crate) fn new(camera: &'a Camera, lens: Option<&'a dyn Distortion>) -> Self {
        let far = |f: f64, c: f64, side: u32| (c.max(f64::from(side) - c) / f).abs();
        let corner = DVec2::new(far(camera.fx, camera.cx, camera.width), far(camera.fy, camera.cy, camera.height));
        Self { camera, lens: lens.map(|lens| (lens, lens.valid_radius(corner.length().max(1e-9)))) }
    }

    /// Returns the photo position of the pinhole position `pixel` (px, centres at 0.5); `None` outside the photo.
    pub(crate) fn source(&self, pixel: DVec2) -> Option<DVec2> {
        let camera = self.camera;
        let Some((lens, valid_radius)) = self.lens else { return Some(pixel) };
        let ideal = DVec2::new((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
        if ideal.length() > valid_radius {
            return None;
        }
        let bent = lens.distort(ideal);
        let at = DVec2::new(bent.x * camera.fx + camera.cx, bent.y * camera.fy + camera.cy);
        let inside = (0.0..f64::from(camera.width)).contains(&at.x) && (0.0..f64::from(camera.height)).contains(&at.y);
        inside.then_some(at)
    }
}

/// Returns the pinhole photo with the intrinsics of `camera`, which has the size of the photo. Pixels outside of the
/// photo are black with alpha 0.
pub(crate) fn undistort_photo(photo: &Photo, camera: &Camera, lens: &Lens) -> Photo {
    let map = Undistortion::new(camera, lens.distortion());
    let row = |y: u32| {
        let map = &map;
        (0..photo.width).map(move |x| {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            map.source(pixel).map_or([0; 4], |at| bilinear(photo, at))
        })
    };
    let rgba = (0..photo.height).into_par_iter().flat_map_iter(row).collect();
    Photo { width: photo.width, height: photo.height, rgba }
}

/// Interpolates between the four nearest pixel centres. The colours at the border continue outwards by half a pixel.
fn bilinear(photo: &Photo, at: DVec2) -> [u8; 4] {
    let split = |value: f64, side: u32| {
        let value = (value - 0.5).clamp(0.0, f64::from(side - 1));
        let low = value.floor();
        (low as u32, (low as u32 + 1).min(side - 1), value - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (split(at.x, photo.width), split(at.y, photo.height));
    let texel = |x: u32, y: u32| photo.rgba[y as usize * photo.width as usize + x as usize];
    let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
    let mut colour = [255u8; 4];
    for channel in 0..3 {
        let [a, b, c, d] = [a, b, c, d].map(|texel| f64::from(texel[channel]));
        let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
        colour[channel] = (top + (bottom - top) * fy).round() as u8;
    }
    colour
}

/// Returns the first source pixel of each target pixel along one side, and the weights from there on, which sum to 1.
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
/// alpha 255. Its alpha is 255 if they cover at least half of its area.
pub(crate) fn shrink_photo(photo: &Photo, width: u32, height: u32) -> Photo {
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
    let (mut sum, mut covered) = ([0.0f64; 3], 0.0);
    for (y, weight_y) in down.iter().enumerate() {
        let start = (top + y) * photo.width as usize + left;
        for (texel, weight_x) in photo.rgba[start..start + across.len()].iter().zip(across) {
            let weight = if texel[3] == 255 { weight_x * weight_y } else { 0.0 };
            covered += weight;
            (0..3).for_each(|channel| sum[channel] += weight * f64::from(texel[channel]));
        }
    }
    if covered < 0.5 - 1e-9 {
        return [0; 4];
    }
    let [r, g, b] = sum.map(|value| (value / covered).round().clamp(0.0, 255.0) as u8);
    [r, g, b, 255]
}

/// Makes the id map for a photo of `width` x `height` px from a map of the distorted photo at any scale. `camera` is
/// that of the photo at its own size. Pixels outside of the photo get 0.
pub(crate) fn resample_ids(ids: &LabelMap, camera: &Camera, lens: &Lens, (width, height): (u32, u32)) -> LabelMap {
    let ids = resample_nearest(&ids.ids, (ids.width, ids.height), camera, lens, (width, height), 0);
    LabelMap { width, height, ids }
}

/// Like [`resample_ids`] for values of any kind; pixels outside of the photo get `nothing`.
pub(crate) fn resample_nearest<T: Copy + Send + Sync>(
    values: &[T],
    from: (u32, u32),
    camera: &Camera,
    lens: &Lens,
    (width, height): (u32, u32),
    nothing: T,
) -> Vec<T> {
    if lens.is_pinhole() && from == (width, height) {
        return values.to_vec();
    }
    let map = Undistortion::new(camera, lens.distortion());
    let to_photo = DVec2::new(f64::from(camera.width) / f64::from(width), f64::from(camera.height) / f64::from(height));
    let to_values =
        DVec2::new(f64::from(from.0) / f64::from(camera.width), f64::from(from.1) / f64::from(camera.height));
    let row = |y: u32| {
        let map = &map;
        (0..width).map(move |x| {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * to_photo;
            map.source(pixel).map_or(nothing, |at| {
                let at = at * to_values;
                values[((at.y as u32).min(from.1 - 1) * from.0 + (at.x as u32).min(from.0 - 1)) as usize]
            })
        })
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// Keeps angles: a ray at angle a from the axis ends at radius a.
    #[derive(Debug)]
    struct Equidistant;

    impl Distortion for Equidistant {
        fn is_finite(&self) -> bool {
            true
        }

        fn distort(&self, ideal: DVec2) -> DVec2 {
            ideal.normalize_or_zero() * self.bent_radius(ideal.length())
        }

        fn bent_radius(&self, radius: f64) -> f64 {
            radius.atan()
        }
    }

    #[test]
    fn any_lens_is_undone() {
        let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
        let camera = Camera { rotation, translation, fx: 10.0, fy: 20.0, cx: 50.0, cy: 40.0, width: 100, height: 80 };
        let map = Undistortion::new(&camera, Some(&Equidistant));
        // 45 degrees to the right, then down.
        let quarter = std::f64::consts::FRAC_PI_4;
        for (pixel, expected) in [
            (DVec2::new(60.0, 40.0), DVec2::new(50.0 + 10.0 * quarter, 40.0)),
            (DVec2::new(50.0, 60.0), DVec2::new(50.0, 40.0 + 20.0 * quarter)),
            (DVec2::new(50.0, 40.0), DVec2::new(50.0, 40.0)),
        ] {
            assert!(map.source(pixel).expect("inside").distance(expected) < 1e-12, "{pixel}");
        }
    }
}
