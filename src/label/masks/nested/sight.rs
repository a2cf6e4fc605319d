//! The Gaussians that a view shows, and the nested masks that own them.

use super::NestedMasks;
use crate::label::masks::associate::Overlap;

/// A mask owns a Gaussian if it has more than this share of the Gaussian's pixels.
const OWNED_SHARE_MIN: f32 = 0.5;

/// The main Gaussians of a view's pixels.
#[derive(Clone, Debug, Default)]
pub(crate) struct ViewSight {
    /// Row and pixel count of each visible Gaussian, sorted by row.
    pub seen: Vec<(u32, f32)>,
    /// For each of these, the start of its masks in `owners`; plus one end entry.
    starts: Vec<u32>,
    /// Mask indices.
    owners: Vec<u16>,
    /// Quality of each mask, 0 to 1.
    pub qualities: Vec<f64>,
    /// Pixels of the view.
    pub pixels: f64,
}

impl ViewSight {
    /// Reads a view from the main Gaussian of each pixel (-1 for none) and masks of the same size.
    pub(crate) fn new(main: &[i32], masks: &NestedMasks) -> Self {
        let mut seen: Vec<(u32, f32)> = Vec::new();
        let mut pixels: Vec<(u32, u32)> =
            main.iter().zip(0..).filter_map(|(&row, at)| Some((u32::try_from(row).ok()?, at))).collect();
        pixels.sort_unstable();
        let (mut starts, mut owners) = (vec![0], Vec::new());
        for of_row in pixels.chunk_by(|a, b| a.0 == b.0) {
            let mut inside: Vec<u16> = Vec::new();
            for layer in &masks.layers {
                inside.extend(of_row.iter().map(|&(_, at)| layer.ids[at as usize]).filter(|&id| id != 0));
            }
            inside.sort_unstable();
            let least = OWNED_SHARE_MIN * of_row.len() as f32;
            let owned = inside.chunk_by(|a, b| a == b).filter(|same| same.len() as f32 >= least);
            owners.extend(owned.map(|same| same[0] - 1));
            starts.push(owners.len() as u32);
            seen.push((of_row[0].0, of_row.len() as f32));
        }
        Self { seen, starts, owners, qualities: masks.qualities.clone(), pixels: main.len() as f64 }
    }

    /// Returns the masks that own the Gaussian at an index of `seen`.
    pub(super) fn owners(&self, at: usize) -> &[u16] {
        &self.owners[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Returns the pixel count of a Gaussian, 0 if it is not visible.
    pub(super) fn weight(&self, row: u32) -> f32 {
        self.seen.binary_search_by_key(&row, |seen| seen.0).map_or(0.0, |at| self.seen[at].1)
    }

    /// Returns the rows that each mask owns, with pixel counts.
    pub(super) fn rows_of_masks(&self) -> Vec<Vec<(u32, f32)>> {
        let mut rows = vec![Vec::new(); self.qualities.len()];
        for (at, seen) in self.seen.iter().enumerate() {
            self.owners(at).iter().for_each(|&mask| rows[usize::from(mask)].push(*seen));
        }
        rows
    }

    /// Returns the overlaps of two views' masks over the Gaussians that both see: both mask indices, the weight owned
    /// by both, and the weight owned by either.
    pub(crate) fn overlaps(&self, other: &Self) -> Vec<(u16, u16, Overlap)> {
        let (rows, columns) = (self.qualities.len(), other.qualities.len());
        let (mut both, mut first, mut second) = (vec![0.0; rows * columns], vec![0.0; rows], vec![0.0; columns]);
        let (mut a, mut b) = (0, 0);
        while a < self.seen.len() && b < other.seen.len() {
            let (left, right) = (self.seen[a], other.seen[b]);
            if left.0 == right.0 {
                let weight = f64::from(left.1.min(right.1));
                self.owners(a).iter().for_each(|&mask| first[usize::from(mask)] += weight);
                for &theirs in other.owners(b) {
                    second[usize::from(theirs)] += weight;
                    self.owners(a)
                        .iter()
                        .for_each(|&ours| both[usize::from(ours) * columns + usize::from(theirs)] += weight);
                }
            }
            a += usize::from(left.0 <= right.0);
            b += usize::from(right.0 <= left.0);
        }
        let cells = both.into_iter().enumerate().filter(|(_, both)| *both > 0.0);
        let overlap = |(cell, both)| {
            let (ours, theirs) = (cell / columns, cell % columns);
            (ours as u16, theirs as u16, Overlap { both, either: first[ours] + second[theirs] - both })
        };
        cells.map(overlap).collect()
    }
}
