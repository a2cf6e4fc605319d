//! Resamples photos and id maps through another lens.
//!
//! Photos are undistorted at their own size with bilinear interpolation, then shrunk by [`labelgs_files::resize`]. Ids
//! are never mixed: each target pixel gets the id at its centre, with size and lens in a single step.

use super::window::Window;
use glam::DVec2;
use labelgs_scene::{Camera, LabelMap, Photo};
use rayon::prelude::*;

/// Returns the photo as seen by one of its pinhole views. Pixels outside the photo are black with alpha 0.
pub fn undistort_photo(photo: &Photo, view: &Window) -> Photo {
    let Camera { width, height, .. } = view.camera;
    let row = |y: u32| {
        (0..width).map(move |x| {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            view.source(pixel).map_or([0; 4], |at| bilinear(photo, at))
        })
    };
    let rgba = (0..height).into_par_iter().flat_map_iter(row).collect();
    Photo { width, height, rgba }
}

/// Interpolates between the four nearest pixel centres, including opacity; invalid if one of them is. Extends the
/// border outwards by half a pixel.
fn bilinear(photo: &Photo, at: DVec2) -> [u8; 4] {
    let split = |value: f64, side: u32| {
        let value = (value - 0.5).clamp(0.0, f64::from(side - 1));
        let low = value.floor();
        (low as u32, (low as u32 + 1).min(side - 1), value - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (split(at.x, photo.width), split(at.y, photo.height));
    let texel = |x: u32, y: u32| photo.rgba[y as usize * photo.width as usize + x as usize];
    let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
    if [a, b, c, d].iter().any(|texel| texel[3] < 128) {
        return [0; 4];
    }
    let mut colour = [0u8; 4];
    for channel in 0..4 {
        let [a, b, c, d] = [a, b, c, d].map(|texel| f64::from(texel[channel]));
        let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
        colour[channel] = (top + (bottom - top) * fy).round() as u8;
    }
    colour
}

/// Creates the id map of a view with `width` x `height` px from a map of its photo at any scale. Pixels outside the
/// photo get 0.
pub fn resample_ids(ids: &LabelMap, view: &Window, (width, height): (u32, u32)) -> LabelMap {
    let ids = resample_nearest(&ids.ids, (ids.width, ids.height), view, (width, height), 0);
    LabelMap { width, height, ids }
}

/// Like [`resample_ids`] for values of any type; pixels outside the photo get `nothing`.
pub fn resample_nearest<T: Copy + Send + Sync>(
    values: &[T],
    from: (u32, u32),
    view: &Window,
    (width, height): (u32, u32),
    nothing: T,
) -> Vec<T> {
    if view.is_photo() && from == (width, height) {
        return values.to_vec();
    }
    let scale = |to: (u32, u32), from: (u32, u32)| {
        DVec2::new(f64::from(to.0) / f64::from(from.0), f64::from(to.1) / f64::from(from.1))
    };
    let (camera, photo) = (&view.camera, &view.optics.camera);
    let to_view = scale((camera.width, camera.height), (width, height));
    let to_values = scale(from, (photo.width, photo.height));
    let row = |y: u32| {
        (0..width).map(move |x| {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * to_view;
            view.source(pixel).map_or(nothing, |at| {
                let at = at * to_values;
                values[((at.y as u32).min(from.1 - 1) * from.0 + (at.x as u32).min(from.0 - 1)) as usize]
            })
        })
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}
