//! Scores over time.

use serde::Serialize;

/// Scores at a moment of a training.
#[derive(Clone, Debug, Serialize)]
pub struct Sample {
    /// Seconds of training.
    pub seconds: f64,
    /// Steps done.
    pub step: u32,
    /// Gaussians.
    pub gaussians: u32,
    /// Mean PSNR of the held-out views, dB.
    pub psnr: Option<f64>,
    /// Mean SSIM.
    pub ssim: Option<f64>,
    /// Mean IoU of objects in the label map.
    pub iou_map: Option<f64>,
    /// Mean IoU of objects rendered alone.
    pub iou_object: Option<f64>,
}

/// A training.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// Kind of training.
    pub kind: &'static str,
    /// Seed.
    pub seed: u64,
    /// In the order of time.
    pub samples: Vec<Sample>,
    /// Seconds that scoring took, which are in no sample.
    pub scoring_seconds: f64,
}

impl Curve {
    /// The end in words.
    pub fn last(&self) -> String {
        let Some(end) = self.samples.last() else { return "nothing".to_owned() };
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        format!("{:.1} s, PSNR {}, IoU {}", end.seconds, number(end.psnr), number(end.iou_map))
    }
}

/// 1, 2, 5, 10, 20, 50, .. times a unit.
pub fn marks(unit: f64) -> impl Iterator<Item = f64> {
    (0..24).map(move |n| unit * [1.0, 2.0, 5.0][n % 3] * 10.0_f64.powi((n / 3) as i32))
}

/// Second at which a score is met for the first time, linear between samples; none if it never is.
pub fn reached(samples: &[Sample], of: fn(&Sample) -> Option<f64>, least: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for sample in samples {
        let now = (sample.seconds, of(sample)?);
        if now.1 >= least {
            let Some((seconds, score)) = before else { return Some(now.0) };
            return Some(seconds + (now.0 - seconds) * ((least - score) / (now.1 - score)).clamp(0.0, 1.0));
        }
        before = Some(now);
    }
    None
}
