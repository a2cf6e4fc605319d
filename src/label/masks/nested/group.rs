//! Masks of several views that show one thing: a candidate for an object.

use super::sight::ViewSight;
use crate::label::masks::associate::{Overlap, Segment, join};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// Smallest overlap at which masks of different views are joined. Parts and wholes stay separate.
const JOINED_MIN: f64 = 0.4;
/// Overlaps of two masks below this are dropped: summed over many views, they rarely exceed `JOINED_MIN`.
const LINKED_MIN: f64 = 0.1;
/// A Gaussian belongs to a group if at least this share of its weight, over the group's views, is in the group's masks.
const MEMBER_SHARE_MIN: f32 = 0.5;
/// Smallest overlap at which two groups are the same: a view may have a tight and a loose mask of one thing.
const SAME_GROUP_MIN: f64 = 0.65;
/// A view sees a group if it shows at least this share of the group's median mask.
const SEEN_SHARE_MIN: f64 = 0.3;

/// A group of masks.
#[derive(Clone, Debug)]
pub(super) struct Group {
    masks: Vec<Segment>,
    /// Gaussians of the group, sorted.
    pub rows: Vec<u32>,
    /// Their pixels in all views.
    pub area: f64,
    /// Mean quality of the best masks over the views that see the group; views without a mask count as 0.
    pub quality: f64,
    /// Share of the views that see the group and have a mask of it.
    pub support: f64,
    /// The best mask of each view that has one.
    pub best: BTreeMap<usize, u16>,
}

/// The masks of all views.
pub(super) struct Scene {
    pub sights: Vec<ViewSight>,
    /// Rows of the masks of each view.
    rows: Vec<Vec<Vec<(u32, f32)>>>,
    /// Pixels of each Gaussian in all views.
    pub weights: Vec<f64>,
}

impl Scene {
    pub(super) fn new(sights: Vec<ViewSight>, gaussians: usize) -> Self {
        let mut weights = vec![0.0; gaussians];
        for &(row, weight) in sights.iter().flat_map(|sight| &sight.seen) {
            weights[row as usize] += f64::from(weight);
        }
        let rows = sights.par_iter().map(ViewSight::rows_of_masks).collect();
        Self { sights, rows, weights }
    }

    /// Returns the groups with at least `least` masks.
    pub(super) fn groups(&self, least: usize) -> Vec<Group> {
        let segments: Vec<Segment> = (self.sights.iter().enumerate())
            .flat_map(|(view, sight)| (0..sight.qualities.len()).map(move |mask| (view, mask as u16)))
            .collect();
        let firsts: Vec<usize> = self
            .sights
            .iter()
            .scan(0, |next, sight| {
                let first = *next;
                *next += sight.qualities.len();
                Some(first)
            })
            .collect();
        let pairs: Vec<(usize, usize)> =
            (0..self.sights.len()).flat_map(|a| (a + 1..self.sights.len()).map(move |b| (a, b))).collect();
        let found: Vec<Vec<(usize, usize, Overlap)>> = pairs
            .par_iter()
            .map(|&(a, b)| {
                let overlaps = self.sights[a].overlaps(&self.sights[b]).into_iter();
                let kept = overlaps.filter(|(.., overlap)| overlap.ratio() >= LINKED_MIN);
                kept.map(|(ours, theirs, overlap)| {
                    (firsts[a] + usize::from(ours), firsts[b] + usize::from(theirs), overlap)
                })
                .collect()
            })
            .collect();
        let mut links: Vec<BTreeMap<usize, Overlap>> = vec![BTreeMap::new(); segments.len()];
        for (a, b, overlap) in found.into_iter().flatten() {
            links[a].insert(b, overlap);
            links[b].insert(a, overlap);
        }
        let joined = join(&segments, links, JOINED_MIN);
        let groups = joined.into_par_iter().filter(|group| group.len() >= least).map(|group| self.group(group));
        self.merged(groups.collect::<Vec<_>>().into_iter().flatten().collect())
    }

    /// Makes a group of masks; `None` if no Gaussian belongs to it.
    fn group(&self, masks: Vec<Segment>) -> Option<Group> {
        let mut best: BTreeMap<usize, u16> = BTreeMap::new();
        for &(view, mask) in &masks {
            let quality = |mask: u16| self.sights[view].qualities[usize::from(mask)];
            let known = best.entry(view).or_insert(mask);
            if quality(mask) > quality(*known) {
                *known = mask;
            }
        }
        let mut inside: HashMap<u32, f32> = HashMap::new();
        for (&view, &mask) in &best {
            self.rows[view][usize::from(mask)]
                .iter()
                .for_each(|&(row, weight)| *inside.entry(row).or_default() += weight);
        }
        let shown = |row: u32| best.keys().map(|&view| self.sights[view].weight(row)).sum::<f32>();
        let members = inside.into_iter().filter(|&(row, weight)| weight >= MEMBER_SHARE_MIN * shown(row));
        let mut rows: Vec<u32> = members.map(|(row, _)| row).collect();
        rows.sort_unstable();
        if rows.is_empty() {
            return None;
        }
        let area = rows.iter().map(|&row| self.weights[row as usize]).sum();
        let visible: Vec<f64> = self.sights.iter().map(|sight| visible(sight, &rows)).collect();
        let mut own: Vec<f64> = best.keys().map(|&view| visible[view]).collect();
        own.sort_by(f64::total_cmp);
        let least = SEEN_SHARE_MIN * (own[own.len() / 2] + own[(own.len() - 1) / 2]) / 2.0;
        let seen = visible.iter().filter(|share| **share >= least).count().max(best.len()) as f64;
        let quality: f64 = best.iter().map(|(&view, &mask)| self.sights[view].qualities[usize::from(mask)]).sum();
        Some(Group { masks, rows, area, quality: quality / seen, support: best.len() as f64 / seen, best })
    }

    /// Joins groups that are the same, by descending overlap.
    fn merged(&self, mut groups: Vec<Group>) -> Vec<Group> {
        loop {
            let mut pairs: Vec<(f64, usize, usize)> = (self.shared(&groups).into_iter())
                .map(|((a, b), both)| (both / (groups[a].area + groups[b].area - both), a, b))
                .filter(|pair| pair.0 >= SAME_GROUP_MIN)
                .collect();
            if pairs.is_empty() {
                return groups;
            }
            pairs.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
            let mut taken = vec![false; groups.len()];
            let mut joined = Vec::new();
            for (_, a, b) in pairs {
                if !taken[a] && !taken[b] {
                    (taken[a], taken[b]) = (true, true);
                    joined.push([groups[a].masks.as_slice(), &groups[b].masks].concat());
                }
            }
            let made: Vec<Group> = joined.into_par_iter().filter_map(|masks| self.group(masks)).collect();
            let mut at = 0;
            groups.retain(|_| {
                at += 1;
                !taken[at - 1]
            });
            groups.extend(made);
        }
    }

    /// Returns the shared weight of each pair of groups that share any, with the smaller index first.
    pub(super) fn shared(&self, groups: &[Group]) -> BTreeMap<(usize, usize), f64> {
        let mut of_row: HashMap<u32, Vec<usize>> = HashMap::new();
        for (group, found) in groups.iter().enumerate() {
            found.rows.iter().for_each(|&row| of_row.entry(row).or_default().push(group));
        }
        let mut rows: Vec<(u32, Vec<usize>)> = of_row.into_iter().collect();
        // A fixed summation order gives the same bits in every run.
        rows.sort_unstable();
        let mut shared = BTreeMap::new();
        for (row, groups) in rows {
            for (at, &a) in groups.iter().enumerate() {
                groups[at + 1..].iter().for_each(|&b| *shared.entry((a, b)).or_default() += self.weights[row as usize]);
            }
        }
        shared
    }
}

/// Returns the share of a view that some Gaussians have.
fn visible(sight: &ViewSight, rows: &[u32]) -> f64 {
    rows.iter().map(|&row| f64::from(sight.weight(row))).sum::<f64>() / sight.pixels
}
