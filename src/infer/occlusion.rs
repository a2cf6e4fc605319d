//! Which objects hide which, seen in one view.
//!
//! The paper compares the mean depth of two bands of one pixel along the contour between two objects. Here the depth is
//! the model's own instead of a network's, and the difference must exceed a margin, so that an object that merely
//! stands on another one is not its occluder.

use crate::scene::{LabelMap, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// Relative difference of depth below which neither object hides the other.
pub const MARGIN: f64 = 0.01;

/// Sum and count of depths along a contour.
#[derive(Clone, Copy, Default)]
struct Band {
    sum: f64,
    count: u64,
}

impl Band {
    fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// For each label of the view, sorted: the labels that hide a part of it, sorted. Every label of the view has an entry;
/// 0 never hides and is never hidden.
///
/// `depth` is z per pixel, row-major, smaller is nearer; what is not finite or not positive is no depth. A pixel is in
/// the band of label k towards k' if its label is k and one of its 8 neighbours is k'.
pub fn occluders(labels: &LabelMap, depth: &[f32], margin: f64) -> BTreeMap<u16, Vec<u16>> {
    let bands = bands(labels, depth);
    let mut hidden_by: BTreeMap<u16, Vec<u16>> =
        labels.objects().into_iter().map(|label| (label, Vec::new())).collect();
    for (&(label, other), own) in &bands {
        let theirs = bands.get(&(other, label)).and_then(Band::mean);
        if let (Some(own), Some(theirs)) = (own.mean(), theirs)
            && theirs < own * (1.0 - margin)
        {
            hidden_by.entry(label).or_default().push(other);
        }
    }
    hidden_by
}

/// Depth along the contours, by (own label, label of the other side).
fn bands(labels: &LabelMap, depth: &[f32]) -> BTreeMap<(u16, u16), Band> {
    let (width, height) = (i64::from(labels.width), i64::from(labels.height));
    let mut bands: BTreeMap<(u16, u16), Band> = BTreeMap::new();
    for y in 0..height {
        for x in 0..width {
            let index = (y * width + x) as usize;
            let own = labels.ids[index];
            if u32::from(own) == UNLABELLED {
                continue;
            }
            let mut others = BTreeSet::new();
            for row in (y - 1).max(0)..=(y + 1).min(height - 1) {
                for column in (x - 1).max(0)..=(x + 1).min(width - 1) {
                    others.insert(labels.ids[(row * width + column) as usize]);
                }
            }
            others.retain(|&other| other != own && u32::from(other) != UNLABELLED);
            let z = f64::from(depth[index]);
            for other in others {
                let band = bands.entry((own, other)).or_default();
                if z.is_finite() && z > 0.0 {
                    *band = Band { sum: band.sum + z, count: band.count + 1 };
                }
            }
        }
    }
    bands
}
