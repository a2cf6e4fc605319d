//! The paper's rule: the object with the smaller mean distance along the contour is in front.

use super::walk;
use crate::scene::{DepthKind, DepthMap, LabelMap, Occluders};
use std::collections::BTreeMap;

/// Returns the distances for [`occluders_by_mean`], `[H, W]`; 0 and NaN are holes.
///
/// For inverse depth d the paper takes 1 - (d - min) / (max - min), with the extremes of the image. The nearest pixel
/// becomes 0, which is a hole. Metric depth is not changed.
pub fn distances(map: &DepthMap, kind: DepthKind) -> Vec<f64> {
    let values = map.values.iter().map(|&value| f64::from(value));
    match kind {
        DepthKind::Metric => values.collect(),
        DepthKind::Inverse => {
            let finite = || values.clone().filter(|value| value.is_finite());
            let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
            values.map(|value| 1.0 - (value - low) / (high - low)).collect()
        }
    }
}

/// Returns the occluders of each object (LabelGS, occlusion analysis). k' hides k if they touch and the mean distance
/// of the contour of k' with k is smaller than that of k with k'. Unlabelled pixels hide nothing. There is no margin,
/// because the scale of the distances is unknown.
pub fn occluders_by_mean(labels: &LabelMap, distance: &[f64]) -> Occluders {
    // Sum and number of the distances along each contour.
    let mut bands: BTreeMap<(u16, u16), (f64, u64)> = BTreeMap::new();
    walk(labels, |own, other, pixel, _| {
        let z = distance[pixel];
        if own != 0 && other != 0 && z.is_finite() && z > 0.0 {
            let (sum, count) = bands.entry((own, other)).or_default();
            (*sum, *count) = (*sum + z, *count + 1);
        }
    });
    let mean = |own: u16, other: u16| bands.get(&(own, other)).map(|&(sum, count)| sum / count as f64);
    let mut hidden_by: Occluders = labels.objects().into_iter().map(|label| (label, Vec::new())).collect();
    for &(label, other) in bands.keys() {
        if let (Some(own), Some(theirs)) = (mean(label, other), mean(other, label))
            && theirs < own
        {
            hidden_by.entry(label).or_default().push(other);
        }
    }
    hidden_by
}
