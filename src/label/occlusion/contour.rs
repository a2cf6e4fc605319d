//! Finds occluders from consistent depth: pixels along a contour vote, and occluders form chains.

use super::hull::Outline;
use super::walk;
use crate::scene::{LabelMap, Occluders};
use std::collections::BTreeMap;

/// The rule that decides which side of a contour is in front.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Relative difference of depth from which a pixel votes. 0.02: a floor seen at 15 degrees in an image of 320 px
    /// changes by 1 % from one pixel to the next, and is not in front of the things on it.
    pub margin: f64,
    /// Share of the votes that must agree. 0.25: a bin is in front of an object inside it along the near part of their
    /// contour, and behind it along the rest. Below 0.5, two objects may hide parts of each other.
    pub share: f64,
    /// Share of all pixels of the contour that must agree. 0.1: less is noise.
    pub least: f64,
    /// Unlabelled pixels may hide objects too.
    pub unlabelled: bool,
}

impl Default for Rule {
    fn default() -> Self {
        Self { margin: 0.02, share: 0.25, least: 0.1, unlabelled: true }
    }
}

/// The votes of one side of a contour.
#[derive(Clone, Copy, Default)]
struct Side {
    /// Number of pixels with depth on both sides.
    votes: u64,
    /// Number of pixels where the other side is nearer by the margin.
    other_nearer: u64,
    /// Number of pixels where this side is nearer by the margin.
    self_nearer: u64,
    /// Sum of the depths on this side.
    depth: f64,
}

impl Side {
    fn mean_depth(&self) -> f64 {
        self.depth / self.votes as f64
    }
}

type Sides = BTreeMap<(u16, u16), Side>;

/// Returns the occluders of each object. `depth` is z per pixel, smaller is nearer; values that are not finite or not
/// positive are holes.
///
/// k' hides k directly if they touch and the pixels on both sides of their contour vote for it by `rule`. Each pixel
/// compares its depth with the mean of its neighbours on the other side.
///
/// k' hides k through a chain k, a, .., k' in which each object hides the previous one directly. k continues behind a,
/// and may also continue behind k' where k' covers a, so these pixels do not prove that k is absent. Each further link
/// must
/// * lie within k: the mean of its pixels is in the convex hull of the pixels of k. An interrupted object continues
///   between its visible parts; without this rule, nearly everything in a crowded scene would hide everything else.
/// * be nearer by the margin, along its contour with the previous link, than k is along its contour with a.
/// * not be hidden by k directly.
pub fn occluders_by_contour(labels: &LabelMap, depth: &[f32], rule: Rule) -> Occluders {
    let sides = sides(labels, depth, rule.margin);
    let mut direct: Occluders = labels.objects().into_iter().map(|label| (label, Vec::new())).collect();
    for (&(label, other), own) in &sides {
        let Some(theirs) = sides.get(&(other, label)).filter(|_| label != 0) else { continue };
        let (agree, against) = (own.other_nearer + theirs.self_nearer, own.self_nearer + theirs.other_nearer);
        let enough = agree as f64 >= rule.least * (own.votes + theirs.votes) as f64;
        let may_hide = other != 0 || rule.unlabelled;
        if may_hide && enough && agree as f64 > rule.share * (agree + against) as f64 {
            direct.entry(label).or_default().push(other);
        }
    }
    let outlines = Outline::find_all(labels);
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

    /// Returns the direct occluders of `label` and the ends of its chains, sorted.
    fn occluders(&self, label: u16) -> Vec<u16> {
        // For each occluder, the largest depth of `label` at the first link of a chain to it.
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
