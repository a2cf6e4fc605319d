//! Exposures of a camera that chooses them.

use super::{SynthOptions, hash01};

/// Gains of photos, from the least to the most.
const GAINS: (f64, f64) = (0.7, 1.4);
/// Gain of a channel over that of the photo, up or down.
const CAST_MAX: f64 = 1.1;

/// Returns the gains of a view, r, g, b.
fn gains(options: &SynthOptions, view: u32) -> [f64; 3] {
    let random = |what: u64| hash01(options.seed, 7, u64::from(view), what);
    let gain = GAINS.0.ln() + (GAINS.1 / GAINS.0).ln() * random(0);
    [1, 2, 3].map(|channel| (gain + CAST_MAX.ln() * (2.0 * random(channel) - 1.0)).exp().clamp(GAINS.0, GAINS.1))
}

/// Returns a photo at the exposure of its view, if the scene has any.
pub(super) fn exposed(options: &SynthOptions, view: u32, mut rgb: Vec<[u8; 3]>) -> Vec<[u8; 3]> {
    if options.vary_exposure {
        let gains = gains(options, view);
        let scaled = |value: u8, gain: f64| (f64::from(value) * gain).round().min(255.0) as u8;
        rgb.iter_mut().for_each(|pixel| *pixel = [0, 1, 2].map(|c| scaled(pixel[c], gains[c])));
    }
    rgb
}
