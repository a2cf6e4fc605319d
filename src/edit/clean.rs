//! Removes floaters: Gaussians that are faint, huge, isolated or far away.

use crate::nearest::tree;
use glam::DVec3;
use kiddo::SquaredEuclidean;
use labelgs_scene::{Gaussians, Result};
use rayon::prelude::*;
use serde::Serialize;
use std::num::NonZero;

/// The neighbour whose distance says how isolated a Gaussian is.
const GAP_NEIGHBOUR: usize = 8;

/// Which Gaussians to remove. The default removes none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cleaning {
    /// Least opacity after the sigmoid.
    pub min_opacity: Option<f32>,
    /// Largest standard deviation along any axis, world units.
    pub max_size: Option<f64>,
    /// Largest distance to the eighth neighbour, as a multiple of the median of that distance.
    pub max_gap: Option<f64>,
    /// Box of the centres: smallest and largest corner, world units.
    pub inside: Option<[DVec3; 2]>,
}

/// Numbers of removed Gaussians, each counted for the first reason that applies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CleaningCounts {
    /// Fainter than the least opacity.
    pub faint: u64,
    /// Larger than the largest size.
    pub huge: u64,
    /// Outside of the box.
    pub outside: u64,
    /// Farther from the others than the largest gap.
    pub lonely: u64,
}

/// Returns the cleaned model and the numbers of removed Gaussians. Isolation is measured among the Gaussians that the
/// other rules keep.
pub fn clean(model: &Gaussians, how: &Cleaning) -> Result<(Gaussians, CleaningCounts)> {
    let mut counts = CleaningCounts::default();
    let kept = model.filtered(|row| {
        let opacity = 1.0 / (1.0 + (-model.opacities[row]).exp());
        let size = model.scales[row].iter().fold(f32::MIN, |most, &scale| most.max(scale));
        let place = model.world(row);
        let reasons = [
            (how.min_opacity.is_some_and(|least| opacity < least), &mut counts.faint),
            (how.max_size.is_some_and(|most| f64::from(size).exp() > most), &mut counts.huge),
            (how.inside.is_some_and(|[low, high]| place != place.clamp(low, high)), &mut counts.outside),
        ];
        match reasons.into_iter().find(|reason| reason.0) {
            Some((_, count)) => *count += 1,
            None => return true,
        }
        false
    });
    let Some(most) = how.max_gap else { return Ok((kept, counts)) };
    let places: Vec<[f64; 3]> = kept.means.iter().map(|mean| mean.map(f64::from)).collect();
    let gaps = gaps(&places)?;
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    let limit = sorted.get(sorted.len() / 2).map_or(f64::INFINITY, |median| most * median);
    counts.lonely = gaps.iter().filter(|&&gap| gap > limit).count() as u64;
    Ok((kept.filtered(|row| gaps[row] <= limit), counts))
}

/// Returns the distance of each position to its eighth neighbour, or to the farthest if there are fewer.
pub(super) fn gaps(places: &[[f64; 3]]) -> Result<Vec<f64>> {
    // +1: the query returns the position itself.
    let Some(asked) = NonZero::new((GAP_NEIGHBOUR + 1).min(places.len())) else { return Ok(Vec::new()) };
    let tree = tree(places)?;
    let gap = |place: &[f64; 3]| {
        let found = tree.query(place).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        found.iter().map(|item| item.distance).fold(0.0, f64::max).sqrt()
    };
    Ok(places.par_iter().map(gap).collect())
}
