//! PSNR after colour correction: ignores errors of exposure and white balance.
//!
//! Fits the best affine map from the render's colours to the photo's over all pixels of a view, as multinerf and
//! nerfstudio do for captures with varying exposure. It hides every error of that form, so it does not replace PSNR.

use super::metrics::{clamped, colour_of, mean, psnr_of, square};
use crate::scene::Photo;
use glam::{DMat4, DVec4};

/// Regularises the equations of pictures with few colours; far below the rounding of a pixel.
const COLOUR_RIDGE: f64 = 1e-6;

/// Returns the PSNR of the corrected render over the photo's valid pixels that count, dB; `None` without any. The map
/// is fitted to the same pixels. `render` and photo have the same size.
pub(super) fn psnr_corrected(render: &[[f32; 3]], photo: &Photo, counts: impl Fn(usize) -> bool) -> Option<f64> {
    let pairs = || {
        let pixels = render.iter().zip(&photo.rgba).enumerate();
        let valid = pixels.filter(|&(index, (_, texel))| texel[3] > 0 && counts(index));
        valid.map(|(_, (&colour, &texel))| {
            let [x, y, z] = clamped(colour);
            (DVec4::new(x, y, z, 1.0), colour_of(texel))
        })
    };
    let mut products = DMat4::from_diagonal(DVec4::splat(COLOUR_RIDGE));
    // Without information the map is the identity.
    let mut sides = [DVec4::X, DVec4::Y, DVec4::Z].map(|unit| COLOUR_RIDGE * unit);
    for (colour, truth) in pairs() {
        for axis in 0..4 {
            *products.col_mut(axis) += colour * colour[axis];
        }
        (0..3).for_each(|channel| sides[channel] += colour * truth[channel]);
    }
    let inverse = products.inverse();
    let maps = sides.map(|side| inverse * side);
    let corrected = |colour: DVec4| maps.map(|map| map.dot(colour).clamp(0.0, 1.0));
    mean(pairs().map(|(colour, truth)| square(corrected(colour), truth))).map(psnr_of)
}

#[cfg(test)]
mod tests {
    use super::psnr_corrected;
    use crate::scene::Photo;

    #[test]
    fn gains_and_casts_do_not_count_and_detail_does() {
        let at = |i: u32| [(i % 16) as f32 / 20.0, (i / 16) as f32 / 20.0, (i % 7) as f32 / 10.0];
        let byte = |value: f32| (value * 255.0).round() as u8;
        let rgba: Vec<[u8; 4]> = (0..256)
            .map(|i| {
                let [r, g, b] = at(i);
                [byte(0.7 * r + 0.1), byte(0.9 * g), byte(0.2 * r + 0.8 * b), 255]
            })
            .collect();
        let photo = Photo { width: 16, height: 16, rgba };
        let render: Vec<[f32; 3]> = (0..256).map(at).collect();
        // Only the rounding to bytes remains.
        let corrected = |render: &[[f32; 3]]| psnr_corrected(render, &photo, |_| true).unwrap();
        assert!(corrected(&render) > 55.0);
        let mut shuffled = render.clone();
        shuffled.rotate_left(5);
        assert!(corrected(&shuffled) < 30.0);
        assert!(corrected(&vec![[0.5; 3]; 256]).is_finite());
        // A hole that does not count does not affect the map either.
        let holed: Vec<[f32; 3]> = (0..256).map(|i| if i < 100 { [0.0; 3] } else { at(i) }).collect();
        assert!(corrected(&holed) < 30.0);
        assert!(psnr_corrected(&holed, &photo, |index| index >= 100).unwrap() > 55.0);
        assert_eq!(psnr_corrected(&holed, &photo, |_| false), None);
    }
}
