//! Chooses objects among nested candidates: masks of a photo, or groups of masks across photos.

use std::collections::BTreeSet;

/// A candidate is a part of a larger one if at least this share of it is inside.
const INSIDE_SHARE_MIN: f64 = 0.85;
/// Smallest area ratio of a whole to its part.
const LARGER_RATIO_MIN: f64 = 1.15;

/// Returns the parts of each candidate, given all areas and the areas that pairs share.
pub fn parts_of(areas: &[f64], shared: impl Iterator<Item = ((usize, usize), f64)>) -> Vec<Vec<usize>> {
    let mut parts = vec![Vec::new(); areas.len()];
    for ((a, b), both) in shared {
        for (part, whole) in [(a, b), (b, a)] {
            let (small, large) = (areas[part], areas[whole]);
            if large >= LARGER_RATIO_MIN * small && both >= INSIDE_SHARE_MIN * small {
                parts[whole].push(part);
            }
        }
    }
    parts
}

/// Chooses objects from the parts upwards. A whole is chosen if its area times its quality is at least what the best
/// choice among its parts explains; `explained` returns that for a choice, summing the best quality everywhere. There
/// is no limit on size: a sheet with everything on it is rejected, because the things on it have higher quality.
pub fn objects(
    areas: &[f64],
    qualities: &[f64],
    parts: &[Vec<usize>],
    explained: impl Fn(&BTreeSet<usize>) -> f64,
) -> BTreeSet<usize> {
    let mut order: Vec<usize> = (0..areas.len()).collect();
    order.sort_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(a.cmp(&b)));
    let mut chosen: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); areas.len()];
    for whole in order {
        let inside: BTreeSet<usize> = parts[whole].iter().flat_map(|&part| &chosen[part]).copied().collect();
        let stands = areas[whole] * qualities[whole] >= explained(&inside);
        chosen[whole] = if stands { BTreeSet::from([whole]) } else { inside };
    }
    let of_others: BTreeSet<usize> = parts.iter().flatten().copied().collect();
    let top = (0..areas.len()).filter(|thing| !of_others.contains(thing));
    top.flat_map(|thing| std::mem::take(&mut chosen[thing])).collect()
}
