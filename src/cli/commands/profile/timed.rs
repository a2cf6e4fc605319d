//! The workload of the steps of a profile.

use crate::train::{LabelWork, StepReport};
use crate::words::counted;
use std::collections::BTreeSet;

/// The workload of the timed steps.
#[derive(Clone, Debug, Default)]
pub struct TimedWork {
    /// Sizes of photos, px, the smallest first.
    pub sizes: BTreeSet<(u32, u32)>,
    /// Degrees of the spherical harmonics.
    pub degrees: BTreeSet<u32>,
    /// Steps with object layers.
    pub layers: usize,
    /// Steps with the disagreement of labels.
    pub disagreement: usize,
    /// Mean number of pixels.
    pub pixels: f64,
}

impl TimedWork {
    /// Sums steps up.
    pub fn new(reports: &[StepReport]) -> Self {
        let with = |labels| reports.iter().filter(|report| report.kind.labels == labels).count();
        let pixels = reports.iter().map(|report| f64::from(report.kind.size.0) * f64::from(report.kind.size.1));
        Self {
            sizes: reports.iter().map(|report| report.kind.size).collect(),
            degrees: reports.iter().map(|report| report.kind.sh_degree).collect(),
            layers: with(LabelWork::Layers),
            disagreement: with(LabelWork::Disagreement),
            pixels: pixels.sum::<f64>() / reports.len().max(1) as f64,
        }
    }

    /// Returns the largest size.
    pub fn size(&self) -> (u32, u32) {
        self.sizes
            .iter()
            .copied()
            .max_by_key(|&(width, height)| u64::from(width) * u64::from(height))
            .unwrap_or_default()
    }

    /// Returns it in words.
    pub fn to_text(&self) -> String {
        let (width, height) = self.size();
        let sizes = if self.sizes.len() > 1 { "up to " } else { "" };
        let range =
            |first: &u32, last: &u32| if first == last { first.to_string() } else { format!("{first} to {last}") };
        let degrees = self.degrees.first().zip(self.degrees.last()).map(|(first, last)| range(first, last));
        let labels = match (self.layers, self.disagreement) {
            (0, 0) => "without labels".to_owned(),
            (layers, others) => {
                format!("object layers in {}, disagreement of labels in {others}", counted(layers, "step"))
            }
        };
        format!("{sizes}{width} x {height} px, degree {}, {labels}", degrees.unwrap_or_default())
    }
}
