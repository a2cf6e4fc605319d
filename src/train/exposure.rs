//! Exposure and white balance of each photo: gains of red, green and blue, trained beside the Gaussians.
//!
//! A camera that chooses its exposure shows the same surface brighter in one photo than in another. Without gains, Gaussians
//! near the cameras make up for it, which spoils other views. The picture of a step is multiplied by the gains of its
//! photo before the loss. The mean of their logarithms stays near 0, so that the model has the mean exposure.

use super::shared::{Place, SharedLayout, SharedParameters};
use super::strategy::At;
use super::{ExposureMode, TrainConfig};
use crate::pass::{Builder, Extension, Hook, loss};
use std::sync::Arc;

/// Learning rate of ln gain. A photo has one update for each of its turns, some dozens in a short run.
const RATE: f64 = 0.01;
/// Root mean square of ln gain over the photos from which their exposures differ. Captures with a fixed exposure have up to
/// 0.04, by what shines and by noise.
const DIFFERS: f64 = 0.07;
/// Share of the photos whose gains must be known for a decision.
const KNOWN: f64 = 0.5;

/// Name of the parameters.
pub(super) const NAME: &str = "exposure";

/// Gains of a photo, r, g, b; `None` where nothing tells them.
pub(crate) type Gains = Option<[f64; 3]>;

/// Gains of each training photo, as logarithms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exposure {
    start: Vec<[f32; 3]>,
    is_fixed: bool,
}

impl Exposure {
    /// Makes the parameters from first gains of each photo. Their geometric mean becomes 1.
    pub fn new(first: &[Gains]) -> Self {
        let logs: Vec<[f64; 3]> = first.iter().map(|gains| gains.map_or([0.0; 3], |of| of.map(f64::ln))).collect();
        let mean = [0, 1, 2].map(|c| logs.iter().map(|of| of[c]).sum::<f64>() / logs.len().max(1) as f64);
        let start = logs.iter().map(|of| [0, 1, 2].map(|c| (of[c] - mean[c]) as f32)).collect();
        Self { start, is_fixed: false }
    }

    /// Makes gains that stay as they are; 1 where none are given.
    pub fn fixed<'a>(gains: impl Iterator<Item = Option<&'a [f32; 3]>>) -> Self {
        Self { start: gains.map(|gains| gains.map_or([0.0; 3], |of| of.map(f32::ln))).collect(), is_fixed: true }
    }
}

/// Returns the root mean square of ln gain over photos and channels; `None` if too few gains are known.
fn spread(gains: &[Gains]) -> Option<f64> {
    let known: Vec<f64> = gains.iter().flatten().flatten().map(|gain| gain.ln().powi(2)).collect();
    let enough = known.len() as f64 >= 3.0 * KNOWN * gains.len() as f64 && !known.is_empty();
    enough.then(|| (known.iter().sum::<f64>() / known.len() as f64).sqrt())
}

/// Returns the settings with `auto` decided by the gains of the photos, and says why.
pub fn decided(config: &TrainConfig, gains: &[Gains]) -> TrainConfig {
    if config.exposure != ExposureMode::Auto {
        return config.clone();
    }
    let exposure = match spread(gains) {
        _ if config.random_background => ExposureMode::Off,
        Some(spread) if spread >= DIFFERS => {
            tracing::info!(
                "exposure: on, because the photos' brightness differs by {:.0} %; set `exposure` to off to train without",
                100.0 * spread
            );
            ExposureMode::On
        }
        _ => ExposureMode::Off,
    };
    TrainConfig { exposure, ..config.clone() }
}

impl SharedParameters for Exposure {
    fn name(&self) -> &'static str {
        NAME
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 0, photo: 1 }
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        let row = |view: usize| {
            let [r, g, b] = self.start.get(view).copied().unwrap_or_default();
            [r, g, b, 0.0]
        };
        view.into_iter().map(row).collect()
    }

    fn rates(&self, at: At) -> Vec<[f32; 4]> {
        let rate = if self.is_fixed { 0.0 } else { (RATE * at.config.rate_fall(at.step)) as f32 };
        vec![[rate, rate, rate, 0.0]]
    }

    fn extension(&self, place: Place) -> Arc<dyn Extension> {
        Arc::new(Passes(place))
    }
}

#[derive(Debug)]
struct Passes(Place);

impl Extension for Passes {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        match hook {
            Hook::Picture => loss::expose(b, self.0.photo),
            Hook::Loss => loss::expose_backward(b, self.0.photo, self.0.all.photo),
            Hook::Camera | Hook::Gradients | Hook::Updated => {}
        }
    }
}
