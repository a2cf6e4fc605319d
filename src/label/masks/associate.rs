//! Groups the masks of different views into objects by the Gaussians they own.
//!
//! A single-image segmenter renumbers masks in every photo, and trackers lose and swap ids. A trained scene
//! connects the views: two masks show one object if the same Gaussians make their pixels (the Gaussian memory of Gaga,
//! here with exact counts instead of the front-most layer).

use crate::label::vote::ballot::{Ballot, weight};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Weight in a view above which a Gaussian counts as visible there, px.
const VISIBLE_WEIGHT_MIN_PX: f64 = 0.25;
/// Share of this weight in one mask above which the mask owns the Gaussian.
const OWNED_SHARE_MIN: f64 = 0.5;
/// Overlap of two groups of masks above which they are one object.
pub(crate) const SAME_OBJECT_OVERLAP_MIN: f64 = 0.25;

/// The owner of each Gaussian among the masks of a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Owners {
    /// Ids of the view's masks, sorted; 0 is the background.
    pub ids: Vec<u16>,
    /// For each Gaussian, the index of its owner in `ids` and its weight in the view, px. `None` if it is not visible
    /// or no mask has a majority.
    pub rows: Vec<Option<(u16, f32)>>,
}

impl Owners {
    /// Finds the owners from the votes of one view.
    pub fn new(ballot: &Ballot) -> Self {
        let owner = |row: usize| {
            let votes = ballot.row(row);
            let total: f64 = votes.iter().map(|&(_, votes)| weight(votes)).sum();
            let &(place, best) = votes.iter().max_by_key(|&&(place, votes)| (votes, u16::MAX - place))?;
            (total >= VISIBLE_WEIGHT_MIN_PX && weight(best) >= OWNED_SHARE_MIN * total).then_some((place, total as f32))
        };
        Self { ids: ballot.labels.clone(), rows: (0..ballot.len()).map(owner).collect() }
    }
}

/// A mask: index of its view, and its id in that view.
pub type Segment = (usize, u16);

/// The overlap of two groups: weight owned by both, and weight owned by either, over Gaussians visible in both views.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Overlap {
    pub both: f64,
    pub either: f64,
}

impl Overlap {
    fn plus(self, other: Self) -> Self {
        Self { both: self.both + other.both, either: self.either + other.either }
    }

    pub(crate) fn ratio(self) -> f64 {
        if self.either > 0.0 { self.both / self.either } else { 0.0 }
    }
}

/// Groups the masks of all views, without 0, into objects. It joins the two groups with the largest overlap until no
/// overlap exceeds `SAME_OBJECT_OVERLAP_MIN`. Two masks of one view never join. Returns the groups, each sorted, in
/// order of their first masks.
pub fn associate(views: &[Owners]) -> Vec<Vec<Segment>> {
    let segments: Vec<Segment> = (views.iter().enumerate())
        .flat_map(|(view, owners)| owners.ids.iter().filter(|&&id| id != 0).map(move |&id| (view, id)))
        .collect();
    let number: BTreeMap<Segment, usize> = segments.iter().copied().zip(0..).collect();
    let mut links: Vec<BTreeMap<usize, Overlap>> = vec![BTreeMap::new(); segments.len()];
    for first in 0..views.len() {
        for second in first + 1..views.len() {
            for ((a, b), overlap) in overlaps(&views[first], &views[second]) {
                let (a, b) = (number[&(first, a)], number[&(second, b)]);
                links[a].insert(b, overlap);
                links[b].insert(a, overlap);
            }
        }
    }
    join(&segments, links, SAME_OBJECT_OVERLAP_MIN)
}

/// Returns the overlaps of the masks of two views, by ids, over the Gaussians visible in both.
fn overlaps(first: &Owners, second: &Owners) -> Vec<((u16, u16), Overlap)> {
    let (columns, mut table) = (second.ids.len(), vec![0.0; first.ids.len() * second.ids.len()]);
    for (a, b) in first.rows.iter().zip(&second.rows) {
        if let (Some((a, weight_a)), Some((b, weight_b))) = (a, b) {
            table[usize::from(*a) * columns + usize::from(*b)] += f64::from(weight_a.min(*weight_b));
        }
    }
    let row = |a: usize| table[a * columns..][..columns].iter().sum::<f64>();
    let column = |b: usize| (0..first.ids.len()).map(|a| table[a * columns + b]).sum::<f64>();
    let (rows, sums): (Vec<f64>, Vec<f64>) =
        ((0..first.ids.len()).map(row).collect(), (0..columns).map(column).collect());
    let mut found = Vec::new();
    for (a, &id_a) in first.ids.iter().enumerate().filter(|(_, id)| **id != 0) {
        for (b, &id_b) in second.ids.iter().enumerate().filter(|(_, id)| **id != 0) {
            let both = table[a * columns + b];
            let either = rows[a] + sums[b] - both;
            if either > 0.0 {
                found.push(((id_a, id_b), Overlap { both, either }));
            }
        }
    }
    found
}

/// Joins the two groups with the largest overlap until no overlap reaches `least`: agglomerative clustering with
/// average linkage. `links` are the overlaps between segments. Two masks of one view never join.
pub(crate) fn join(segments: &[Segment], mut links: Vec<BTreeMap<usize, Overlap>>, least: f64) -> Vec<Vec<Segment>> {
    let mut groups: Vec<Vec<Segment>> = segments.iter().map(|&segment| vec![segment]).collect();
    let mut seen_in: Vec<BTreeSet<usize>> = segments.iter().map(|&(view, _)| [view].into()).collect();
    // Candidate pairs, ordered by overlap, then by number, so that the order is deterministic. The bits of positive
    // floats sort like their values.
    let candidate = |a: usize, b: usize, overlap: Overlap| {
        let ratio = overlap.ratio();
        (ratio >= least).then_some((ratio.to_bits(), Reverse((a.min(b), a.max(b)))))
    };
    let pairs = links.iter().enumerate().flat_map(|(a, row)| row.iter().map(move |(&b, &overlap)| (a, b, overlap)));
    let mut heap: BinaryHeap<(u64, Reverse<(usize, usize)>)> =
        pairs.filter(|(a, b, _)| a < b).filter_map(|(a, b, overlap)| candidate(a, b, overlap)).collect();
    while let Some((ratio, Reverse((a, b)))) = heap.pop() {
        // An entry is stale if one of its groups has changed.
        let current = links[a].get(&b).is_some_and(|overlap| overlap.ratio().to_bits() == ratio);
        if !current || groups[a].is_empty() || groups[b].is_empty() || !seen_in[a].is_disjoint(&seen_in[b]) {
            continue;
        }
        let (gone, views) = (std::mem::take(&mut groups[b]), std::mem::take(&mut seen_in[b]));
        groups[a].extend(gone);
        seen_in[a].extend(views);
        links[a].remove(&b);
        for (other, overlap) in std::mem::take(&mut links[b]) {
            if other == a {
                continue;
            }
            let sum = links[a].get(&other).copied().unwrap_or_default().plus(overlap);
            links[a].insert(other, sum);
            links[other].remove(&b);
            links[other].insert(a, sum);
        }
        let renewed = links[a].iter().filter_map(|(&other, &overlap)| candidate(a, other, overlap));
        heap.extend(renewed);
    }
    let mut groups: Vec<Vec<Segment>> = groups.into_iter().filter(|group| !group.is_empty()).collect();
    groups.iter_mut().for_each(|group| group.sort_unstable());
    groups.sort_unstable_by_key(|group| group[0]);
    groups
}
