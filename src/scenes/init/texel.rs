//! Colours of a photo at points.

use glam::DVec2;
use labelgs_scene::Photo;

/// Returns the colour of the pixel at a point (px), if the photo has one there.
pub(super) fn texel(photo: &Photo, pixel: DVec2) -> Option<[u8; 3]> {
    let [r, g, b, valid] = photo.rgba[pixel.y as usize * photo.width as usize + pixel.x as usize];
    (valid >= 128).then_some([r, g, b])
}
