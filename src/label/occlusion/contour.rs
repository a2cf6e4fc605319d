//! Occluders from depth that means the same everywhere: a vote of the contour's pixels, and chains of occluders.

use super::hull::Outline;
use super::walk;
use crate::scene::{LabelMap, Occluders};
use std::collections::BTreeMap;

/// When one side of a contour is in front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Relative difference of depth at which a pixel takes sides. 0.02: a floor seen at 15 degrees in a picture of 320 px
    /// changes by 1 % from one pixel to the next, and is not in front of what stands on it.
    pub margin: f64,
    /// Share of the pixels that take sides which must agree, at least 0.5. 0.5: something that stands on another thing is
    /// in front of it along most of its contour, and along the rest, where the two touch, no pixel takes sides.
    pub majority: f64,
    /// Share of all pixels of the contour that must agree. 0.1: less is noise of a few pixels.
    pub least: f64,
}

impl Default for Rule {
    fn default() -> Self {
        Self { margin: 0.02, majority: 0.5, least: 0.1 }
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

type Sides = BTreeMap<(u16, u16), Side>;

/// Occluders of each object. `depth` is z per pixel, smaller is nearer; what is not finite or not positive is none.
///
/// k' hides k directly if they touch and the pixels on both sides of their contour vote for it by `rule`; each compares
/// its own depth with the mean of its neighbours across.
///
/// k' hides k through a chain k, a, .., k' in which each hides the one before directly: k goes on behind a, and where k'
/// covers a nothing says that k ends there, so that its pixels cannot say that k is absent. Each further link must
/// * lie within k: the mean of its pixels is in the convex hull of those of k, because what is interrupted goes on
///   between its visible parts, and without this nearly everything in a crowd would hide everything;
/// * be nearer by the margin, along its contour towards the link before, than k is where it goes under a;
/// * not be hidden by k directly.
pub fn by_contour(labels: &LabelMap, depth: &[f32], rule: Rule) -> Occluders {
    let sides = sides(labels, depth, rule.margin);
    let mut direct: Occluders = labels.objects().into_iter().map(|label| (label, Vec::new())).collect();
    for (&(label, other), own) in &sides {
        let Some(theirs) = sides.get(&(other, label)) else { continue };
        let (agree, against) = (own.other_nearer + theirs.self_nearer, own.self_nearer + theirs.other_nearer);
        let enough = agree as f64 >= rule.least * (own.votes + theirs.votes) as f64;
        if enough && agree as f64 > rule.majority * (agree + against) as f64 {
            direct.entry(label).or_default().push(other);
        }
    }
    let outlines = Outline::of_all(labels);
    let chains = Chains { direct: &direct, sides: &sides, outlines: &outlines, margin: rule.margin };
    direct.keys().map(|&label| (label, chains.occluders(label))).collect()
}

fn sides(labels: &LabelMap, depth: &[f32], margin: f64) -> Sides {
    let known = |pixel: usize| Some(f64::from(depth[pixel])).filter(|z| z.is_finite() && *z > 0.0);
    let mut sides = Sides::new();
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

/// What chains are followed with.
struct Chains<'a> {
    direct: &'a Occluders,
    sides: &'a Sides,
    outlines: &'a BTreeMap<u16, Outline>,
    margin: f64,
}

impl Chains<'_> {
    fn hidden_by(&self, label: u16) -> &[u16] {
        self.direct.get(&label).map(Vec::as_slice).unwrap_or_default()
    }

    fn mean_depth(&self, own: u16, other: u16) -> Option<f64> {
        self.sides.get(&(own, other)).map(Side::mean_depth)
    }

    fn within(&self, inner: u16, outer: u16) -> bool {
        match (self.outlines.get(&inner), self.outlines.get(&outer)) {
            (Some(inner), Some(outer)) => outer.contains(inner.mean()),
            _ => false,
        }
    }

    /// The direct occluders of `label` and those at the end of a chain, sorted.
    fn occluders(&self, label: u16) -> Vec<u16> {
        // For each occluder the largest depth at which `label` goes under the first link of a chain to it.
        let mut reached: BTreeMap<u16, f64> = BTreeMap::new();
        let first = self.hidden_by(label).iter();
        let mut open: Vec<(u16, f64)> =
            first.filter_map(|&other| Some((other, self.mean_depth(label, other)?))).collect();
        while let Some((link, goes_under)) = open.pop() {
            if reached.get(&link).is_some_and(|&before| before >= goes_under) {
                continue;
            }
            reached.insert(link, goes_under);
            let next = self.hidden_by(link).iter().copied().filter(|&next| {
                let nearer = self.mean_depth(next, link).is_some_and(|z| z < goes_under * (1.0 - self.margin));
                next != label && nearer && !self.hidden_by(next).contains(&label) && self.within(next, label)
            });
            open.extend(next.map(|next| (next, goes_under)));
        }
        reached.into_keys().collect()
    }
}
