//! A photo with model depths.

use crate::files::resize::shrink_photo;
use crate::scene::{Camera, Photo};

/// Longest side of a frame, px. Positions are found to a hundredth of a pixel.
const SIDE_MAX: u32 = 640;
/// Most bytes of all frames together; with many photos, frames are smaller.
const BYTES_MAX: f64 = (1_u64 << 30) as f64;
/// Bytes per pixel: colour with derivatives, and depth.
const PIXEL_BYTES: f64 = 40.0;
/// Smallest opacity at which the model's depth counts as a surface.
const ALPHA_MIN: f32 = 0.98;

/// A photo with model depths, row-major.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Camera at the frame's size.
    pub(super) camera: Camera,
    /// Colours, 0 to 1, and their derivatives by x and y, 1 / px. Differences of pixels two apart have less noise than
    /// neighbours, and poses converge in fewer rounds.
    pub(super) colours: Vec<[[f32; 3]; 3]>,
    /// Depths along the camera axis, world units; NaN at invalid photo pixels and where the model is not opaque.
    pub(super) depth: Vec<f32>,
}

impl Frame {
    /// Returns the camera of a photo's frame, given the number of frames.
    pub(crate) fn camera_of(photo: &Camera, count: usize) -> Camera {
        let pixels = f64::from(photo.width) * f64::from(photo.height);
        let by_side = f64::from(SIDE_MAX) / f64::from(photo.width.max(photo.height));
        let by_bytes = (BYTES_MAX / (PIXEL_BYTES * count as f64) / pixels).sqrt();
        photo.shrunk(by_side.min(by_bytes).min(1.0))
    }

    /// Makes a frame. `camera` comes from [`Self::camera_of`]; `depth` and `alpha` are the model's summed depth and
    /// opacity of each pixel.
    pub(crate) fn new(camera: Camera, photo: &Photo, depth: &[f32], alpha: &[f32]) -> Self {
        let photo = shrink_photo(photo, camera.width, camera.height);
        let rgb: Vec<_> =
            photo.rgba.iter().map(|&[r, g, b, _]| [r, g, b].map(|value| f32::from(value) / 255.0)).collect();
        let known = |((pixel, &depth), &alpha): ((&[u8; 4], &f32), &f32)| {
            if pixel[3] == u8::MAX && alpha >= ALPHA_MIN { depth / alpha } else { f32::NAN }
        };
        let depth = photo.rgba.iter().zip(depth).zip(alpha).map(known).collect();
        Self::from_colours(camera, &rgb, depth)
    }

    /// Makes a frame from colours.
    pub(super) fn from_colours(camera: Camera, rgb: &[[f32; 3]], depth: Vec<f32>) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let slope = |before: usize, after: usize| std::array::from_fn(|k| 0.5 * (rgb[after][k] - rgb[before][k]));
        let at = |index: usize| {
            let (x, y) = (index % width, index / width);
            let by_x = slope(index - x.min(1), index + usize::from(x + 1 < width));
            let by_y = slope(index - width * y.min(1), index + width * usize::from(y + 1 < height));
            [rgb[index], by_x, by_y]
        };
        Self { colours: (0..rgb.len()).map(at).collect(), camera, depth }
    }

    pub(super) fn side(&self) -> u32 {
        self.camera.width.max(self.camera.height)
    }

    /// Returns the frame at half size: means of 2 x 2 pixels. An odd last row or column is dropped.
    pub(super) fn halved(&self) -> Self {
        let Camera { width, height, .. } = self.camera;
        let (columns, rows) = (width / 2, height / 2);
        let even = Camera { width: 2 * columns, height: 2 * rows, ..self.camera.clone() };
        let camera = even.resized(columns, rows);
        let four = |index: u32| {
            let (x, y) = (2 * (index % camera.width), 2 * (index / camera.width));
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| ((y + down) * width + x + right) as usize)
        };
        let pixels = || 0..camera.width * camera.height;
        let rgb = |index| {
            [0, 1, 2].map(|channel| four(index).map(|from| self.colours[from][0][channel]).iter().sum::<f32>() / 4.0)
        };
        // A NaN makes the mean NaN.
        let depth = |index| four(index).map(|from| self.depth[from]).iter().sum::<f32>() / 4.0;
        let (rgb, depth): (Vec<_>, _) = (pixels().map(rgb).collect(), pixels().map(depth).collect());
        Self::from_colours(camera, &rgb, depth)
    }

    /// Returns the interpolated colour and its derivatives by x and y, 1 / px, at a position in px; `None` at the
    /// border and outside.
    pub(super) fn colours(&self, x: f64, y: f64) -> Option<[[f64; 3]; 3]> {
        let (column, row) = ((x - 0.5).floor(), (y - 0.5).floor());
        let is_inside = column >= 0.0
            && row >= 0.0
            && column + 1.0 < f64::from(self.camera.width)
            && row + 1.0 < f64::from(self.camera.height);
        if !is_inside {
            return None;
        }
        let (right, down) = (x - 0.5 - column, y - 0.5 - row);
        let width = self.camera.width as usize;
        let first = row as usize * width + column as usize;
        let four = [
            (first, (1.0 - right) * (1.0 - down)),
            (first + 1, right * (1.0 - down)),
            (first + width, (1.0 - right) * down),
            (first + width + 1, right * down),
        ];
        let mut found = [[0.0; 3]; 3];
        for (index, share) in four {
            let sums = found.as_flattened_mut().iter_mut();
            sums.zip(self.colours[index].as_flattened()).for_each(|(sum, &value)| *sum += share * f64::from(value));
        }
        Some(found)
    }

    /// Returns the depth of the pixel at a position in px; NaN if unknown.
    pub(super) fn depth_at(&self, x: f64, y: f64) -> f64 {
        let is_inside =
            (0.0..f64::from(self.camera.width)).contains(&x) && (0.0..f64::from(self.camera.height)).contains(&y);
        if !is_inside {
            return f64::NAN;
        }
        self.depth[y as usize * self.camera.width as usize + x as usize].into()
    }
}

#[cfg(test)]
mod tests {
    use super::Frame;
    use crate::scene::Camera;
    use glam::{DMat3, DVec3};

    #[test]
    fn colours_between_pixels_are_mixed() {
        let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
        let camera = Camera { rotation, translation, fx: 5.0, fy: 5.0, cx: 2.5, cy: 2.0, width: 5, height: 4 };
        // A linear ramp in one channel: its derivatives are constant except at the border.
        let rgb: Vec<[f32; 3]> =
            (0..20_u8).map(|k| [0.1 * f32::from(k % 5) + 0.02 * f32::from(k / 5), 0.5, 0.5]).collect();
        let frame = Frame::from_colours(camera, &rgb, vec![1.0; 20]);
        let [value, by_x, by_y] = frame.colours(2.3, 1.9).expect("inside");
        for (found, expected) in [(value[0], 0.1 * 1.8 + 0.02 * 1.4), (by_x[0], 0.1), (by_y[0], 0.02), (by_x[1], 0.0)] {
            assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
        }
        assert_eq!(frame.colours(2.5, 1.5).expect("a centre")[0], rgb[7].map(f64::from));
        assert!(frame.colours(0.4, 2.0).is_none() && frame.colours(2.0, 3.6).is_none());
    }
}
