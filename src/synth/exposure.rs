//! Exposures of a camera in automatic mode.

use super::{SynthOptions, hash01};

/// Smallest gain of a photo.
const GAIN_MIN: f64 = 0.7;
/// Largest gain of a photo.
const GAIN_MAX: f64 = 1.4;
/// Largest gain of a channel relative to its photo, in either direction.
const CAST_MAX: f64 = 1.1;

/// Returns the gains of a view, r, g, b.
fn gains(options: &SynthOptions, view: u32) -> [f64; 3] {
    let random = |what: u64| hash01(options.seed, 7, u64::from(view), what);
    let gain = GAIN_MIN.ln() + (GAIN_MAX / GAIN_MIN).ln() * random(0);
    [1, 2, 3].map(|channel| (gain + CAST_MAX.ln() * (2.0 * random(channel) - 1.0)).exp().clamp(GAIN_MIN, GAIN_MAX))
}

/// Applies the exposure of a view to its photo, if the scene varies exposures.
pub(super) fn exposed(options: &SynthOptions, view: u32, mut rgb: Vec<[u8; 3]>) -> Vec<[u8; 3]> {
    if options.vary_exposure {
        let gains = gains(options, view);
        let scaled = |value: u8, gain: f64| (f64::from(value) * gain).round().min(255.0) as u8;
        rgb.iter_mut().for_each(|pixel| *pixel = [0, 1, 2].map(|c| scaled(pixel[c], gains[c])));
    }
    rgb
}
