//! Exposure and white balance of each photo: a colour matrix, trained together with the Gaussians.
//!
//! With automatic exposure, the same surface is brighter in some photos than in others, and its colour varies with the
//! light. Without a matrix, Gaussians near the cameras compensate for this, which degrades other views. Before the
//! loss, the picture's colours are multiplied by the photo's matrix: each channel takes a share of the other two, then
//! gets a gain. The mean of all values over the photos stays near 0, so that the model has the mean exposure.

use super::{RowOffsets, SharedLayout, SharedParameters};
use crate::Setting;
use crate::pass::{Builder, Extension, Hook, loss};
use crate::scene::ColourMatrix;
use crate::shaders::constants::{EXPOSURE_ROWS, EXPOSURE_SHARE};
use crate::train::strategy::StepContext;
use crate::train::{ExposureMode, TrainConfig};
use std::sync::Arc;

/// Learning rate of ln gain and of shares. A photo gets only some dozens of updates in a short run.
const LEARNING_RATE: f64 = 0.01;
/// Smallest root mean square of ln gain at which exposures count as different. Captures with fixed exposure have up to
/// 0.04, because of reflections and noise.
const SPREAD_MIN: f64 = 0.07;
/// Share of the photos whose gains must be known for a decision.
const KNOWN_SHARE_MIN: f64 = 0.5;

/// Name of the parameters.
pub(in crate::train) const EXPOSURE_NAME: &str = "exposure";

/// Gains of a photo, r, g, b; `None` if unknown.
pub(crate) type Gains = Option<[f64; 3]>;

/// Rows of a photo (glsl/include/exposure.glsl).
pub(crate) type Rows = [[f32; 4]; EXPOSURE_ROWS as usize];

/// Converts a photo's rows to a matrix.
pub(in crate::train) fn matrix_of(rows: &[[f32; 4]]) -> ColourMatrix {
    let mut matrix = [[0.0; 3]; 3];
    for (k, of) in matrix.iter_mut().enumerate() {
        let gain = f64::from(rows[0][k]).exp();
        let [next, last] = [1, 2].map(|row| {
            let x = f64::from(rows[row][k]);
            x / (1.0 + x.abs() / f64::from(EXPOSURE_SHARE))
        });
        of[k] = (gain * (1.0 - next - last)) as f32;
        of[(k + 1) % 3] = (gain * next) as f32;
        of[(k + 2) % 3] = (gain * last) as f32;
    }
    matrix
}

/// Converts a matrix to a photo's rows; `None` for matrices that no training can produce: each channel takes less than
/// [`EXPOSURE_SHARE`] of each other channel, and its values have a positive sum.
pub(crate) fn rows_of(matrix: &ColourMatrix) -> Option<Rows> {
    let mut rows = Rows::default();
    for (k, of) in matrix.iter().enumerate() {
        let of = of.map(f64::from);
        let gain = of.iter().sum::<f64>();
        rows[0][k] = gain.ln() as f32;
        for row in [1, 2] {
            let share = of[(k + row) % 3] / gain;
            rows[row][k] = (share / (1.0 - share.abs() / f64::from(EXPOSURE_SHARE))) as f32;
            if !(gain > 0.0 && share.abs() < f64::from(EXPOSURE_SHARE)) {
                return None;
            }
        }
    }
    Some(rows)
}

/// First rows of each training photo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exposure {
    start: Vec<Rows>,
    is_fixed: bool,
}

impl Exposure {
    /// Makes the parameters from first gains of each photo. Their geometric mean becomes 1.
    pub fn new(first: &[Gains]) -> Self {
        let logs: Vec<[f64; 3]> = first.iter().map(|gains| gains.map_or([0.0; 3], |of| of.map(f64::ln))).collect();
        let mean = [0, 1, 2].map(|c| logs.iter().map(|of| of[c]).sum::<f64>() / logs.len().max(1) as f64);
        let row = |of: &[f64; 3]| {
            let [r, g, b] = [0, 1, 2].map(|c| (of[c] - mean[c]) as f32);
            [[r, g, b, 0.0], [0.0; 4], [0.0; 4]]
        };
        Self { start: logs.iter().map(row).collect(), is_fixed: false }
    }

    /// Makes fixed rows; photos without rows have the scene's colours.
    pub fn fixed<'a>(rows: impl Iterator<Item = Option<&'a Rows>>) -> Self {
        Self { start: rows.map(|rows| rows.copied().unwrap_or_default()).collect(), is_fixed: true }
    }
}

/// Returns the root mean square of ln gain over photos and channels; `None` if too few gains are known.
fn spread(gains: &[Gains]) -> Option<f64> {
    let known: Vec<f64> = gains.iter().flatten().flatten().map(|gain| gain.ln().powi(2)).collect();
    let enough = known.len() as f64 >= 3.0 * KNOWN_SHARE_MIN * gains.len() as f64 && !known.is_empty();
    enough.then(|| (known.iter().sum::<f64>() / known.len() as f64).sqrt())
}

/// Decides `auto` by the gains of the photos, and logs the reason.
pub fn decided(config: &TrainConfig, gains: &[Gains]) -> TrainConfig {
    if config.exposure != ExposureMode::Auto {
        return config.clone();
    }
    let exposure = match spread(gains) {
        _ if config.random_background => ExposureMode::Off,
        Some(spread) if spread >= SPREAD_MIN => {
            tracing::info!(
                "exposure: on, because brightness differs between photos by {:.0} %; set {} to train without it",
                100.0 * spread,
                Setting("exposure").to("off")
            );
            ExposureMode::On
        }
        _ => ExposureMode::Off,
    };
    TrainConfig { exposure, ..config.clone() }
}

impl SharedParameters for Exposure {
    fn name(&self) -> &'static str {
        EXPOSURE_NAME
    }

    fn layout(&self) -> SharedLayout {
        SharedLayout { scene: 0, photo: EXPOSURE_ROWS }
    }

    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]> {
        view.into_iter().flat_map(|view| self.start.get(view).copied().unwrap_or_default()).collect()
    }

    fn rates(&self, at: StepContext) -> Vec<[f32; 4]> {
        let rate = if self.is_fixed { 0.0 } else { (LEARNING_RATE * at.config.rate_fall(at.step)) as f32 };
        vec![[rate, rate, rate, 0.0]; EXPOSURE_ROWS as usize]
    }

    fn extension(&self, place: RowOffsets) -> Arc<dyn Extension> {
        Arc::new(ExposurePasses(place))
    }
}

#[derive(Debug)]
struct ExposurePasses(RowOffsets);

impl Extension for ExposurePasses {
    fn extend(&self, _passes: u32, hook: Hook, b: &mut Builder) {
        match hook {
            Hook::Picture => loss::expose(b, self.0.photo),
            Hook::Loss => loss::expose_backward(b, self.0.photo, self.0.all.photo),
            Hook::Camera | Hook::Gradients | Hook::Updated => {}
        }
    }

    fn splits_update(&self, _passes: u32) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::{matrix_of, rows_of};

    #[test]
    fn rows_and_matrices_of_a_photo_are_the_same() {
        let rows = [[0.3, -0.2, 0.1, 0.0], [0.2, -0.1, 0.5, 0.0], [-0.3, 0.4, 0.05, 0.0]];
        let matrix = matrix_of(&rows);
        for (k, of) in matrix.iter().enumerate() {
            let gain = rows[0][k].exp();
            assert!((of.iter().sum::<f32>() - gain).abs() < 1e-6, "grey keeps the gain alone");
            assert!((of[(k + 1) % 3] - gain * rows[1][k] / (1.0 + rows[1][k].abs() / 0.24)).abs() < 1e-6);
        }
        let again = rows_of(&matrix).expect("rows");
        for (of, expected) in again.as_flattened().iter().zip(rows.as_flattened()) {
            assert!((of - expected).abs() < 1e-5, "{again:?}");
        }
        assert_eq!(rows_of(&[[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None, "too much of green");
        assert_eq!(rows_of(&[[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None);
    }
}
