//! LPIPS v0.1 with VGG16 (Zhang et al. 2018) on the CPU.
//!
//! Both pictures go through the 13 convolutions of VGG16. After each of its five stages, the features of a pixel are
//! scaled to length 1. The squared differences of the channels are weighted, summed over channels, averaged over
//! pixels, and summed over stages.

pub mod convolution;
pub mod weights;

use crate::error::{Error, Result, Setting};
use crate::eval::protocol::score::Distance;
use convolution::{Planes, convolve, halve};
pub use weights::Weights;

/// Indices of the convolutions of each stage in torchvision's `features`. Each stage after the first starts with
/// pooling.
pub const STAGE_CONVOLUTIONS: [&[usize]; 5] = [&[0, 2], &[5, 7], &[10, 12, 14], &[17, 19, 21], &[24, 26, 28]];
/// Number of output channels of each stage.
pub const STAGE_CHANNELS: [usize; 5] = [64, 128, 256, 512, 512];
/// Smallest side of a picture, px: four poolings leave one pixel.
const SIDE_MIN: usize = 16;
/// Mean of each input channel, for values from -1 to 1.
const CHANNEL_MEANS: [f32; 3] = [-0.030, -0.088, -0.188];
/// Standard deviation of each input channel.
const CHANNEL_DEVIATIONS: [f32; 3] = [0.458, 0.448, 0.450];
/// Added to the length of a feature vector, to avoid division by zero.
const EPSILON: f32 = 1e-10;

impl Distance for Weights {
    fn distance(&self, a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> Result<f64> {
        if width < SIDE_MIN || height < SIDE_MIN {
            let problem =
                format!("needs pictures of at least {SIDE_MIN} x {SIDE_MIN} px, but one has {width} x {height}");
            return Err(Error::usage(Setting("lpips"), problem));
        }
        let (mut a, mut b) = (input(a, width, height), input(b, width, height));
        let mut total = 0.0;
        for stage in 0..STAGE_CONVOLUTIONS.len() {
            if stage > 0 {
                (a, b) = (halve(&a), halve(&b));
            }
            for &number in STAGE_CONVOLUTIONS[stage] {
                let layer = self.layer(number)?;
                (a, b) = (convolve(&a, layer), convolve(&b, layer));
            }
            total += difference(&a, &b, self.linear(stage));
        }
        Ok(total)
    }
}

/// Converts colours from 0 to 1 to the input of VGG16.
fn input(colours: &[[f32; 3]], width: usize, height: usize) -> Planes {
    let channel =
        |c: usize| colours.iter().map(move |colour| (2.0 * colour[c] - 1.0 - CHANNEL_MEANS[c]) / CHANNEL_DEVIATIONS[c]);
    Planes { channels: 3, width, height, values: (0..3).flat_map(channel).collect() }
}

/// Returns the mean over pixels of the weighted squared difference of normalised features.
fn difference(a: &Planes, b: &Planes, weights: &[f32]) -> f64 {
    let area = a.width * a.height;
    let at = |planes: &Planes, channel: usize, pixel: usize| planes.values[channel * area + pixel];
    let length = |planes: &Planes, pixel: usize| {
        (0..planes.channels).map(|channel| at(planes, channel, pixel).powi(2)).sum::<f32>().sqrt() + EPSILON
    };
    let one = |pixel: usize| {
        let (long_a, long_b) = (length(a, pixel), length(b, pixel));
        let square = |channel: usize| (at(a, channel, pixel) / long_a - at(b, channel, pixel) / long_b).powi(2);
        (0..a.channels).map(|channel| f64::from(weights[channel] * square(channel))).sum::<f64>()
    };
    (0..area).map(one).sum::<f64>() / area as f64
}
