//! Structural similarity as in 3DGS: an 11x11 Gaussian window with standard deviation 1.5, zero padding, each channel
//! alone, data range 1.

use super::metrics::byte_value;
use crate::scene::Photo;
use rayon::prelude::*;

/// Radius of the window, px.
const WINDOW_REACH_PX: usize = 5;
const WINDOW_SIGMA_PX: f64 = 1.5;
/// Stabilising constants for values in 0 to 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Returns the mean SSIM of a render, clamped to 0..1, against a photo over its valid pixels and three channels.
/// Invalid pixels are black in both images. NaN without valid pixels.
pub fn ssim(render: &[[f32; 3]], photo: &Photo) -> f64 {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let valid: Vec<bool> = photo.rgba.iter().map(|pixel| pixel[3] > 0).collect();
    let count = valid.iter().filter(|&&valid| valid).count() * 3;
    let total: f64 = (0..3)
        .map(|channel| {
            let masked = |value: f64, index: usize| if valid[index] { value } else { 0.0 };
            let colour = |(index, colour): (usize, &[f32; 3])| masked(colour[channel].clamp(0.0, 1.0).into(), index);
            let truth = |(index, pixel): (usize, &[u8; 4])| masked(byte_value(pixel[channel]), index);
            let a: Vec<f64> = render.iter().enumerate().map(colour).collect();
            let b: Vec<f64> = photo.rgba.iter().enumerate().map(truth).collect();
            let map = ssim_map(&a, &b, width, height);
            map.iter().zip(&valid).filter(|&(_, &valid)| valid).map(|(value, _)| value).sum::<f64>()
        })
        .sum();
    total / count as f64
}

/// Returns the SSIM of every pixel of one channel, row-major.
pub fn ssim_map(a: &[f64], b: &[f64], width: usize, height: usize) -> Vec<f64> {
    let product = |x: &[f64], y: &[f64]| blur(&x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<_>>(), width, height);
    let (mean_a, mean_b) = (blur(a, width, height), blur(b, width, height));
    let (aa, bb, ab) = (product(a, a), product(b, b), product(a, b));
    (0..a.len())
        .map(|i| {
            let (mu_a, mu_b) = (mean_a[i], mean_b[i]);
            let (var_a, var_b, cov) = (aa[i] - mu_a * mu_a, bb[i] - mu_b * mu_b, ab[i] - mu_a * mu_b);
            (2.0 * mu_a * mu_b + C1) * (2.0 * cov + C2) / ((mu_a * mu_a + mu_b * mu_b + C1) * (var_a + var_b + C2))
        })
        .collect()
}

/// Returns the window in one dimension, with sum 1.
pub fn window() -> [f64; 2 * WINDOW_REACH_PX + 1] {
    let mut weights = [0.0; 2 * WINDOW_REACH_PX + 1];
    for (index, weight) in weights.iter_mut().enumerate() {
        let offset = index as f64 - WINDOW_REACH_PX as f64;
        *weight = (-offset * offset / (2.0 * WINDOW_SIGMA_PX * WINDOW_SIGMA_PX)).exp();
    }
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// Applies the window along rows, then along columns, with zero padding.
fn blur(image: &[f64], width: usize, height: usize) -> Vec<f64> {
    let weights = window();
    let tap = |centre: usize, length: usize, value: &dyn Fn(usize) -> f64| {
        let first = centre.saturating_sub(WINDOW_REACH_PX);
        (first..(centre + WINDOW_REACH_PX + 1).min(length))
            .map(|at| weights[at + WINDOW_REACH_PX - centre] * value(at))
            .sum::<f64>()
    };
    let rows: Vec<f64> =
        (0..width * height).into_par_iter().map(|i| tap(i % width, width, &|x| image[i / width * width + x])).collect();
    (0..width * height).into_par_iter().map(|i| tap(i / width, height, &|y| rows[y * width + i % width])).collect()
}
