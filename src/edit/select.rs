//! The labels of a model: what there is, and models of some of them.

use super::catalogue::Catalogue;
use crate::scene::{Gaussians, UNLABELLED};
use crate::{Error, Result};
use glam::DVec3;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Least confidence of the Gaussians that an object is made of when it stands alone. What straddles an object and its
/// surroundings, or shows in few pixels, sticks out of the object once nothing is around it.
pub const MIN_LABEL_CONFIDENCE: f32 = 0.6;

/// What a model knows about one label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelSummary {
    /// The label; 0 is unlabelled.
    pub label: u32,
    /// Number of Gaussians.
    pub count: u64,
    /// Sum of their opacities after the sigmoid.
    pub opacity_mass: f64,
    /// Smallest coordinates of the means, world.
    pub min: [f64; 3],
    /// Largest coordinates of the means, world.
    pub max: [f64; 3],
    /// Mean of the means, weighted by opacity, world.
    pub centre: [f64; 3],
}

/// One row per label, sorted, 0 (unlabelled) included. A model without labels is all 0.
pub fn summarise(model: &Gaussians) -> Vec<LabelSummary> {
    struct Sum {
        count: u64,
        mass: f64,
        min: DVec3,
        max: DVec3,
        weighted: DVec3,
    }
    let mut sums: BTreeMap<u32, Sum> = BTreeMap::new();
    for row in 0..model.len() {
        let start = Sum { count: 0, mass: 0.0, min: DVec3::INFINITY, max: DVec3::NEG_INFINITY, weighted: DVec3::ZERO };
        let sum = sums.entry(label_of(model, row)).or_insert(start);
        let mean = model.world(row);
        // Never 0, so that invisible Gaussians have a centre too.
        let opacity = (1.0 / (1.0 + (-f64::from(model.opacities[row])).exp())).max(1e-200);
        sum.count += 1;
        sum.mass += opacity;
        sum.min = sum.min.min(mean);
        sum.max = sum.max.max(mean);
        sum.weighted += mean * opacity;
    }
    let row = |(label, sum): (u32, Sum)| LabelSummary {
        label,
        count: sum.count,
        opacity_mass: sum.mass,
        min: sum.min.to_array(),
        max: sum.max.to_array(),
        centre: (sum.weighted / sum.mass).to_array(),
    };
    sums.into_iter().map(row).collect()
}

/// The Gaussians of these labels, in order, but for those whose confidence is known and less than `least` ([`MIN_LABEL_CONFIDENCE`]);
/// there may be none left. An error, which lists what there is, if one of the labels does not occur.
pub fn extract(model: &Gaussians, labels: &[u32], least: f32) -> Result<Gaussians> {
    let wanted = check_labels(model, labels)?;
    let sure = |row: usize| model.label_confidence.as_ref().is_none_or(|shares| shares[row] >= least);
    Ok(model.filtered(|row| wanted.contains(&label_of(model, row)) && sure(row)))
}

/// All but the Gaussians of these labels, in order. The same errors as [`extract`], and one if nothing is left.
pub fn remove(model: &Gaussians, labels: &[u32]) -> Result<Gaussians> {
    let wanted = check_labels(model, labels)?;
    let rest = model.filtered(|row| !wanted.contains(&label_of(model, row)));
    if rest.is_empty() {
        return Err(Error::usage("labels", "names every label of the model; nothing would be left"));
    }
    Ok(rest)
}

/// The labels as a set, if each of them occurs in the model.
fn check_labels(model: &Gaussians, labels: &[u32]) -> Result<BTreeSet<u32>> {
    let wanted = labels.iter().copied().collect();
    Catalogue::new(model, None).check("labels", &wanted)?;
    Ok(wanted)
}

/// Label of a row; 0 in a model without labels.
fn label_of(model: &Gaussians, row: usize) -> u32 {
    model.labels.as_ref().map_or(UNLABELLED, |labels| labels[row])
}
