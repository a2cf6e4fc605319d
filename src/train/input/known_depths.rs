//! Known depths of photos: a prior for opacity.

use crate::engine::Band;
use crate::scene::{DepthMap, Photo, View};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// Stride at which depth-map pixels are used, along each side.
const PIXEL_STRIDE: usize = 4;

/// Known depths of a photo. Clones share the data.
#[derive(Clone, Debug, Default)]
pub struct KnownDepths(Arc<Vec<KnownDepth>>);

#[derive(Clone, Copy, Debug)]
struct KnownDepth {
    /// Position in the photo, px.
    at: [f32; 2],
    /// 1 / depth along the axis of the camera, 1 / world unit.
    inverse: f32,
}

impl KnownDepths {
    /// Takes depths from points that a view shows, given their pixels.
    pub(crate) fn from_points(view: &View, points: impl Iterator<Item = (DVec2, DVec3)>) -> Self {
        let known = |(at, point): (DVec2, DVec3)| KnownDepth {
            at: at.as_vec2().to_array(),
            inverse: (1.0 / view.camera.to_camera(point).z) as f32,
        };
        Self(Arc::new(points.map(known).filter(|known| known.inverse.is_finite() && known.inverse > 0.0).collect()))
    }

    /// Takes depths from a map of the photo's size, world units. Values that are not finite or not positive are holes.
    pub(crate) fn from_map(map: &DepthMap) -> Self {
        let width = map.width as usize;
        let rows = (PIXEL_STRIDE / 2..map.height as usize).step_by(PIXEL_STRIDE);
        let places = rows.flat_map(|y| (PIXEL_STRIDE / 2..width).step_by(PIXEL_STRIDE).map(move |x| (x, y)));
        let known = |(x, y): (usize, usize)| {
            let inverse = 1.0 / map.values[y * width + x];
            (inverse.is_finite() && inverse > 0.0)
                .then_some(KnownDepth { at: [x as f32 + 0.5, y as f32 + 0.5], inverse })
        };
        Self(Arc::new(places.filter_map(known).collect()))
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Draws a band of a photo of `full` px at the step's size: 1 / depth, 0 if unknown. The nearest depth of a pixel
    /// counts. Pixels that are invalid in `photo`, the band at that size, are 0.
    pub(in crate::train) fn drawn(&self, full: (u32, u32), band: Band, photo: &Photo) -> Vec<f32> {
        let (width, height) = (photo.width, photo.height);
        let mut drawn = vec![0.0_f32; width as usize * height as usize];
        let scale = [width as f32 / full.0 as f32, height as f32 / band.rows as f32];
        for known in self.0.iter() {
            let (x, y) = (known.at[0] * scale[0], (known.at[1] - band.first as f32) * scale[1]);
            if (0.0..width as f32).contains(&x) && (0.0..height as f32).contains(&y) {
                let pixel = y as usize * width as usize + x as usize;
                if photo.rgba[pixel][3] > 0 {
                    drawn[pixel] = drawn[pixel].max(known.inverse);
                }
            }
        }
        drawn
    }
}

/// Returns the weight of a pixel with a known depth, given the total weight.
pub(in crate::train) fn weight(inverse: &[f32], all: f64) -> f32 {
    let count = inverse.iter().filter(|&&inverse| inverse > 0.0).count();
    (all / count.max(1) as f64) as f32
}
