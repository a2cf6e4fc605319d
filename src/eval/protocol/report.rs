//! Benchmark results, for programs and as JSON.

use super::Protocol;
use super::score::PairScores;
use crate::error::Result;
use crate::eval::metrics::check_means;
use serde::Serialize;
use std::collections::BTreeMap;

/// A missing prediction.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MissingPrediction {
    /// Name of the object.
    pub object: String,
    /// Name of the frame; `None` stands for every frame of the object.
    pub frame: Option<String>,
    /// Reason.
    pub reason: String,
}

/// The result for an object over its frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ObjectRow {
    /// The chosen labels.
    pub labels: Vec<u32>,
    /// Number of scored frames.
    pub frames: u64,
    /// Means over these frames.
    #[serde(flatten)]
    pub mean: PairScores,
}

/// The averages of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Means {
    /// Mean over pairs of object and frame.
    pub pairs: PairScores,
    /// Mean over objects of their means over frames.
    pub objects: PairScores,
    /// Number of pairs.
    pub pair_count: u64,
    /// Number of objects with at least one pair.
    pub object_count: u64,
}

/// The score that the benchmark's tables report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Headline {
    /// Kind of IoU: `iou` or `iou_colour`.
    pub key: &'static str,
    /// Kind of average: `pairs` or `objects`.
    pub average: &'static str,
    /// Mean IoU.
    pub iou: Option<f64>,
    /// Mean PSNR, dB.
    pub psnr: Option<f64>,
}

/// Scores of a model in a benchmark. JSON has null for values that are not finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Version of the layout.
    pub schema_version: u32,
    /// Name of the benchmark.
    pub protocol: &'static str,
    /// True for the rules of the published scorer.
    pub compat: bool,
    /// The rules in words.
    pub rules: Vec<&'static str>,
    /// `VGG16, v0.1`, or `no weights`.
    pub lpips: &'static str,
    /// The score that the benchmark's tables report.
    pub headline: Headline,
    /// Averages.
    pub mean: Means,
    /// Results by name of the object.
    pub objects: BTreeMap<String, ObjectRow>,
    /// Scores by frame and object.
    pub views: BTreeMap<String, BTreeMap<String, PairScores>>,
    /// Missing predictions.
    pub missing: Vec<MissingPrediction>,
    /// Prompts that selected nothing.
    pub empty: Vec<MissingPrediction>,
    /// Ground-truth masks that the rules exclude, with reasons.
    pub left_out: Vec<String>,
}

const STRICT_RULES: [&str; 4] = [
    "a missing prediction and an empty selection count as 0 (LPIPS as 1)",
    "iou, boundary_iou and accuracy: opacity above 0.5; iou_colour: any channel above 0.01",
    "psnr: clamped to 0..1, one error over all channels and pixels of the frame, object on black against photo x mask",
    "ssim: 11x11 Gaussian window over the whole frame",
];
const LABELGS_COMPAT_RULES: [&str; 5] = [
    "prompts choose by the label of the Gaussian with the largest weight in a pixel",
    "an empty selection renders the whole scene",
    "iou: any channel above 0.01 is the published one, here iou_colour",
    "psnr: mean of the PSNR of each channel over the whole frame, not clamped",
    "ssim: 8-bit pictures, uniform 7x7 window, sample covariance, over the whole frame",
];
const LERF_MASK_COMPAT_RULES: [&str; 4] = [
    "prompts choose by the label of the Gaussian with the largest weight in a pixel",
    "missing predictions and empty selections are excluded from the averages",
    "psnr: mean of the PSNR of each channel over the whole frame, not clamped",
    "ssim: 8-bit pictures, uniform 7x7 window, sample covariance, over the whole frame",
];

impl Report {
    pub(super) fn new(protocol: Protocol, compat: bool, lpips: bool) -> Self {
        let rules = match (protocol, compat) {
            (Protocol::Labelgs, true) => LABELGS_COMPAT_RULES.to_vec(),
            (Protocol::LerfMask, true) => LERF_MASK_COMPAT_RULES.to_vec(),
            _ => STRICT_RULES.to_vec(),
        };
        let lpips = if lpips { "VGG16, v0.1" } else { "no weights" };
        Self { schema_version: 1, protocol: protocol.name(), compat, rules, lpips, ..Self::default() }
    }

    pub(super) fn object(&mut self, name: &str, labels: Vec<u32>) {
        self.objects.entry(name.to_owned()).or_default().labels = labels;
    }

    pub(super) fn add(&mut self, object: &str, frame: &str, scores: PairScores) {
        self.views.entry(frame.to_owned()).or_default().insert(object.to_owned(), scores);
    }

    pub(super) fn finish(&mut self) {
        for (name, row) in &mut self.objects {
            let own: Vec<&PairScores> = self.views.values().filter_map(|view| view.get(name)).collect();
            row.frames = own.len() as u64;
            row.mean = PairScores::mean(own.into_iter());
        }
        let counted = || self.objects.values().filter(|row| row.frames > 0);
        let pairs = || self.views.values().flat_map(BTreeMap::values);
        self.mean = Means {
            pairs: PairScores::mean(pairs()),
            objects: PairScores::mean(counted().map(|row| &row.mean)),
            pair_count: pairs().count() as u64,
            object_count: counted().count() as u64,
        };
        let colour = self.compat && self.protocol == Protocol::Labelgs.name();
        let by_object = self.protocol == Protocol::LerfMask.name();
        let mean = if by_object { &self.mean.objects } else { &self.mean.pairs };
        self.headline = Headline {
            key: if colour { "iou_colour" } else { "iou" },
            average: if by_object { "objects" } else { "pairs" },
            iou: if colour { mean.iou_colour } else { mean.iou },
            psnr: mean.psnr,
        };
    }

    /// Compares the headline with the bounds of `--min-psnr` and `--min-iou`.
    pub fn check(&self, min_psnr: Option<f64>, min_iou: Option<f64>) -> Result<()> {
        check_means([self.headline.psnr, self.headline.iou], [min_psnr, min_iou])
    }
}
