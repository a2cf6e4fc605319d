//! Occluders from depth that means the same everywhere: a vote of the contour's pixels, and chains of occluders.

use super::walk;
use crate::scene::{LabelMap, Occluders};
use std::collections::BTreeMap;

/// When one side of a contour is in front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Relative difference of depth at which a pixel takes sides. 0.02: a floor seen at 15 degrees in a picture of 320 px
    /// changes by 1 % from one pixel to the next, and is not in front of what stands on it.
    pub margin: f64,
    /// Share of the pixels that must agree, at least 0.5. 0.5: something that stands on another thing touches it along
    /// one side and is in front of it along the others.
    pub majority: f64,
}

impl Default for Rule {
    fn default() -> Self {
        Self { margin: 0.02, majority: 0.5 }
    }
}

/// What the pixels of one side of a contour say.
#[derive(Clone, Copy, Default)]
struct Side {
    /// Pixels with depth here and across.
    votes: u64,
    /// Those that find the other side nearer by the margin.
    other_nearer: u64,
    /// Those that find themselves nearer by the margin.
    self_nearer: u64,
    /// Sum of their own depths.
    depth: f64,
}

impl Side {
    fn mean_depth(&self) -> f64 {
        self.depth / self.votes as f64
    }
}

/// Occluders of each object. `depth` is z per pixel, smaller is nearer; what is not finite or not positive is none.
///
/// k' hides k directly if they touch and more than `majority` of the pixels on both sides of their contour find k'
/// nearer by `margin`; each compares its own depth with the mean of its neighbours across.
///
/// k' hides k through a chain k, a, .., k' in which each hides the one before directly: k goes on behind a, and where k'
/// covers a nothing says that k ends there, so that its pixels cannot say that k is absent. A link counts only if its
/// object is nearer, by the margin and along its contour towards the link before, than k is where it goes under a; and
/// only if k does not hide the object. So a chain cannot come round behind k.
pub fn by_contour(labels: &LabelMap, depth: &[f32], rule: Rule) -> Occluders {
    let sides = sides(labels, depth, rule.margin);
    let mut direct: Occluders = labels.objects().into_iter().map(|label| (label, Vec::new())).collect();
    for (&(label, other), own) in &sides {
        let Some(theirs) = sides.get(&(other, label)) else { continue };
        let (agree, votes) = (own.other_nearer + theirs.self_nearer, own.votes + theirs.votes);
        if agree as f64 > rule.majority * votes as f64 {
            direct.entry(label).or_default().push(other);
        }
    }
    direct.keys().map(|&label| (label, with_chains(label, &direct, &sides, rule.margin))).collect()
}

fn sides(labels: &LabelMap, depth: &[f32], margin: f64) -> BTreeMap<(u16, u16), Side> {
    let known = |pixel: usize| Some(f64::from(depth[pixel])).filter(|z| z.is_finite() && *z > 0.0);
    let mut sides: BTreeMap<(u16, u16), Side> = BTreeMap::new();
    walk(labels, |own, other, pixel, neighbours| {
        let (sum, count) =
            neighbours.iter().filter_map(|&at| known(at)).fold((0.0, 0_u32), |(sum, count), z| (sum + z, count + 1));
        let Some(here) = known(pixel).filter(|_| count > 0) else { return };
        let across = sum / f64::from(count);
        let side = sides.entry((own, other)).or_default();
        side.votes += 1;
        side.other_nearer += u64::from(across < here * (1.0 - margin));
        side.self_nearer += u64::from(here < across * (1.0 - margin));
        side.depth += here;
    });
    sides
}

/// The direct occluders of `label` and those at the end of a chain, sorted.
fn with_chains(label: u16, direct: &Occluders, sides: &BTreeMap<(u16, u16), Side>, margin: f64) -> Vec<u16> {
    let mean = |own: u16, other: u16| sides.get(&(own, other)).map(Side::mean_depth);
    let hidden_by = |label: u16| direct.get(&label).map(Vec::as_slice).unwrap_or_default();
    // For each occluder the largest depth at which `label` goes under the first link of a chain to it.
    let mut reached: BTreeMap<u16, f64> = BTreeMap::new();
    let first = hidden_by(label).iter().filter_map(|&other| Some((other, mean(label, other)?)));
    let mut open: Vec<(u16, f64)> = first.collect();
    while let Some((link, goes_under)) = open.pop() {
        if reached.get(&link).is_some_and(|&before| before >= goes_under) {
            continue;
        }
        reached.insert(link, goes_under);
        let next = hidden_by(link).iter().copied().filter(|&next| {
            let nearer = mean(next, link).is_some_and(|z| z < goes_under * (1.0 - margin));
            next != label && nearer && !hidden_by(next).contains(&label)
        });
        open.extend(next.map(|next| (next, goes_under)));
    }
    reached.into_keys().collect()
}
