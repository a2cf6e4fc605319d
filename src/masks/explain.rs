//! Which of nested things are objects: masks of a photo, or groups of masks of many photos.

use std::collections::BTreeSet;

/// Share of a thing inside of a larger one above which it is a part of it.
const INSIDE_SHARE_MIN: f64 = 0.85;
/// Least ratio of the areas of a whole and its part.
const LARGER_RATIO_MIN: f64 = 1.15;

/// Returns the parts of each thing, by the areas of all and what pairs of them share.
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

/// Chooses objects from the parts up: a whole stands if its area times its quality is at least what the best choice inside of it
/// explains, a sum of the best quality everywhere, which `explained` returns of a choice. No size is asked for: a sheet with
/// everything on it falls, because the things on it are surer than it is.
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
