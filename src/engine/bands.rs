//! Draws pictures in bands of rows, if they have more tiles than a device can process at once.

use super::Engine;
use super::uniforms::with_slopes_of;
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
    /// Returns the band's pixel range in a row-major picture.
    pub(crate) fn pixels(self, width: u32) -> std::ops::Range<usize> {
        let (first, width) = (self.first as usize, width as usize);
        first * width..(first + self.rows as usize) * width
    }

    /// Returns the camera of the band's rows.
    pub(crate) fn camera(self, whole: &Camera) -> Camera {
        Camera { cy: whole.cy - f64::from(self.first), height: self.rows, ..whole.clone() }
    }

    /// Splits a picture into bands of `most` rows; the last may be smaller.
    pub(crate) fn split(height: u32, most: u32) -> Vec<Self> {
        let most = most.max(1);
        (0..height.div_ceil(most)).map(|at| Self { first: at * most, rows: most.min(height - at * most) }).collect()
    }
}

impl Engine {
    /// Returns the bands in which a picture of the camera is drawn: one, unless it has too many tiles for the device.
    pub(crate) fn bands(&self, camera: &Camera) -> Vec<Band> {
        Band::split(camera.height, self.size.band(&self.shape).unwrap_or(camera.height))
    }

    /// Returns the camera's part of the uniforms for a band. The slope limits are those of the whole picture.
    pub(crate) fn band_uniforms(&self, camera: &Camera, band: Band, near: f32, background: [f32; 3]) -> StepUniforms {
        self.part_uniforms(&band.camera(camera), Some(camera), near, background)
    }

    /// Returns the camera's part of the uniforms. For a part of a picture, the slope limits are those of the `whole`
    /// picture.
    pub(crate) fn part_uniforms(
        &self,
        camera: &Camera,
        whole: Option<&Camera>,
        near: f32,
        background: [f32; 3],
    ) -> StepUniforms {
        let part = self.view_uniforms(camera, near, background);
        let Some(whole) = whole else { return part };
        with_slopes_of(part, &self.view_uniforms(whole, near, background))
    }
}

#[cfg(test)]
mod tests {
    use super::Band;

    #[test]
    fn bands_cover_a_picture_once() {
        let band = |first, rows| Band { first, rows };
        assert_eq!(Band::split(7, 3), [band(0, 3), band(3, 3), band(6, 1)]);
        assert_eq!(Band::split(6, 6), [band(0, 6)]);
        assert_eq!(band(3, 3).pixels(10), 30..60);
    }
}
