//! Lists the labels of a model and extracts models of some labels.

use super::catalogue::Catalogue;
use glam::DVec3;
use labelgs_scene::{Error, Gaussians, Result, Setting};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Smallest label confidence in an extracted object. Gaussians that straddle an object and its background, or cover few
/// pixels, stick out once nothing surrounds them.
pub const MIN_LABEL_CONFIDENCE: f32 = 0.6;

/// Statistics of a label's Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LabelSummary {
    /// The label; 0 is unlabelled.
    pub label: u32,
    /// Number of Gaussians.
    pub count: u64,
    /// Sum of opacities after the sigmoid.
    pub opacity_mass: f64,
    /// Smallest coordinates of the means, world units.
    pub min: [f64; 3],
    /// Largest coordinates of the means, world units.
    pub max: [f64; 3],
    /// Opacity-weighted mean of the means, world units.
    pub centre: [f64; 3],
}

/// Accumulates statistics per label, one Gaussian at a time.
#[derive(Clone, Debug, Default)]
pub struct Tally(BTreeMap<u32, LabelSummary>);

impl Tally {
    /// Adds a Gaussian: its label, its position in the world, and its opacity after the sigmoid.
    pub fn add(&mut self, label: u32, mean: DVec3, opacity: f64) {
        let (min, max, centre) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
        let start = LabelSummary { label, count: 0, opacity_mass: 0.0, min, max, centre };
        let sum = self.0.entry(label).or_insert(start);
        // Never 0, so that invisible Gaussians have a centre too.
        let opacity = opacity.max(1e-200);
        sum.count += 1;
        sum.opacity_mass += opacity;
        sum.min = DVec3::from(sum.min).min(mean).to_array();
        sum.max = DVec3::from(sum.max).max(mean).to_array();
        // Holds the weighted sum until `summaries` divides it.
        sum.centre = (DVec3::from(sum.centre) + mean * opacity).to_array();
    }

    /// Returns the number of Gaussians per label.
    pub fn counts(&self) -> BTreeMap<u32, u64> {
        self.0.iter().map(|(&label, sum)| (label, sum.count)).collect()
    }

    /// Returns one row per label, sorted.
    pub fn summaries(&self) -> Vec<LabelSummary> {
        let row = |sum: &LabelSummary| LabelSummary { centre: sum.centre.map(|at| at / sum.opacity_mass), ..*sum };
        self.0.values().map(row).collect()
    }
}

/// Returns one row per label, sorted, including 0 (unlabelled). Without labels, all Gaussians have label 0.
pub fn summarise(model: &Gaussians) -> Vec<LabelSummary> {
    let mut tally = Tally::default();
    (0..model.len()).for_each(|row| tally.add(model.label(row), model.world(row), model.opacity(row)));
    tally.summaries()
}

/// Returns the mean confidence of each label in the model; empty if the model has no confidences.
pub fn mean_confidence(model: &Gaussians) -> BTreeMap<u32, f64> {
    let mut sums: BTreeMap<u32, (f64, u64)> = BTreeMap::new();
    for (row, &share) in model.label_confidence.iter().flatten().enumerate() {
        let (sum, count) = sums.entry(model.label(row)).or_default();
        (*sum, *count) = (*sum + f64::from(share), *count + 1);
    }
    sums.into_iter().map(|(label, (sum, count))| (label, sum / count as f64)).collect()
}

/// Returns the Gaussians of these labels in order, possibly none. Omits Gaussians with a known confidence below `least`
/// ([`MIN_LABEL_CONFIDENCE`]). A missing label is an error that lists the known labels.
pub fn extract(model: &Gaussians, labels: &[u32], least: f32) -> Result<Gaussians> {
    let wanted = check_labels(model, labels)?;
    let sure = |row: usize| model.label_confidence.as_ref().is_none_or(|shares| shares[row] >= least);
    Ok(model.filtered(|row| wanted.contains(&model.label(row)) && sure(row)))
}

/// Returns the Gaussians of all other labels, in order. Errors as in [`extract`], or if no Gaussian remains.
pub fn remove(model: &Gaussians, labels: &[u32]) -> Result<Gaussians> {
    let wanted = check_labels(model, labels)?;
    let rest = model.filtered(|row| !wanted.contains(&model.label(row)));
    if rest.is_empty() {
        return Err(nothing_left());
    }
    Ok(rest)
}

/// Returns the error of a choice that would leave no Gaussian.
pub fn nothing_left() -> Error {
    Error::usage(Setting("labels"), "names every label of the model; no Gaussian would be left")
}

fn check_labels(model: &Gaussians, labels: &[u32]) -> Result<BTreeSet<u32>> {
    let wanted = labels.iter().copied().collect();
    Catalogue::new(model, None).check("labels", &wanted)?;
    Ok(wanted)
}
