//! Pictures with more tiles than a device can walk, in bands of rows.

use super::Engine;
use crate::scene::Camera;
use crate::shaders::structs::StepUniforms;

/// Rows of a picture that one list draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Band {
    /// First row, px.
    pub first: u32,
    /// Number of rows, px.
    pub rows: u32,
}

impl Band {
    /// Returns the range of its pixels in a row-major picture.
    pub(crate) fn pixels(self, width: u32) -> std::ops::Range<usize> {
        let (first, width) = (self.first as usize, width as usize);
        first * width..(first + self.rows as usize) * width
    }

    /// Returns the bands of a picture, all but the last with `most` rows.
    fn all(height: u32, most: u32) -> Vec<Self> {
        let most = most.max(1);
        (0..height.div_ceil(most)).map(|at| Self { first: at * most, rows: most.min(height - at * most) }).collect()
    }
}

impl Engine {
    /// Returns the bands in which a picture of the camera is drawn: one, unless the device cannot walk its tiles at once.
    pub(crate) fn bands(&self, camera: &Camera) -> Vec<Band> {
        let most = self.size.band(&self.shape).unwrap_or(camera.height);
        Band::all(camera.height, if self.size.trained { camera.height } else { most })
    }

    /// Returns the camera's part of the uniforms for a band. Slopes keep the limits of the whole picture, so that bands fit
    /// together.
    pub(crate) fn band_uniforms(&self, camera: &Camera, band: Band, near: f32, background: [f32; 3]) -> StepUniforms {
        let part = Camera { cy: camera.cy - f64::from(band.first), height: band.rows, ..camera.clone() };
        let whole = self.view_uniforms(camera, near, background);
        StepUniforms {
            clamp_y_min: whole.clamp_y_min,
            clamp_y_max: whole.clamp_y_max,
            ..self.view_uniforms(&part, near, background)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Band;

    #[test]
    fn bands_cover_a_picture_once() {
        let band = |first, rows| Band { first, rows };
        assert_eq!(Band::all(7, 3), [band(0, 3), band(3, 3), band(6, 1)]);
        assert_eq!(Band::all(6, 6), [band(0, 6)]);
        assert_eq!(band(3, 3).pixels(10), 30..60);
    }
}
