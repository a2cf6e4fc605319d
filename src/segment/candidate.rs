//! Finds all masks in a photo by prompting a network at every point of a grid.

use super::network::{Answer, Network, PreparedPhoto};
use super::prompt::Prompt;
use labelgs_masks::nested::quality;
use labelgs_scene::{Result, parallel};

/// Quantisation steps of a stored logit per unit.
const LOGIT_STEPS: f32 = 16.0;
/// Logit offset of the two cuts whose areas give a mask's stability, as in Segment Anything.
const STABILITY_OFFSET: f32 = 1.0;
/// Two masks with a larger IoU are duplicates.
const DUPLICATE_IOU_MIN: f64 = 0.7;

/// Options for finding masks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Points of the grid per side.
    pub grid: usize,
    /// Smallest score predicted by the network.
    pub min_score: f32,
    /// Smallest stability, 0 to 1.
    pub min_stability: f32,
}

/// A mask on the network's grid.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// The cells inside, one bit each, row-major.
    cells: Vec<u64>,
    /// Quantised logits.
    logits: Vec<i8>,
    /// Number of cells inside.
    pub area: u32,
    /// The network's estimate of the mask's IoU with an object.
    pub score: f32,
    /// IoU between the mask cut at a higher and at a lower logit.
    pub stability: f32,
}

impl Candidate {
    /// Creates a mask from logits.
    pub fn new(logits: &[f32], score: f32) -> Self {
        let mut cells = vec![0; logits.len().div_ceil(64)];
        for (at, _) in logits.iter().enumerate().filter(|(_, logit)| **logit > 0.0) {
            cells[at / 64] |= 1 << (at % 64);
        }
        let above = |level: f32| logits.iter().filter(|logit| **logit > level).count() as f32;
        let stability = above(STABILITY_OFFSET) / above(-STABILITY_OFFSET).max(1.0);
        let steps = logits.iter().map(|logit| (logit * LOGIT_STEPS).round().clamp(-128.0, 127.0) as i8).collect();
        let area = cells.iter().map(|word: &u64| word.count_ones()).sum();
        Self { cells, logits: steps, area, score, stability }
    }

    /// Returns the number of cells that the photo covers.
    pub fn cells(&self) -> usize {
        self.logits.len()
    }

    /// Returns how far the mask can be trusted, 0 to 1.
    pub fn quality(&self) -> f64 {
        quality(f64::from(self.score.clamp(0.0, 1.0) * self.stability))
    }

    /// Returns the number of cells inside both.
    pub fn shared(&self, other: &Self) -> u32 {
        self.cells.iter().zip(&other.cells).map(|(a, b)| (a & b).count_ones()).sum()
    }

    /// Returns the intersection over the union.
    pub fn iou(&self, other: &Self) -> f64 {
        let both = self.shared(other);
        f64::from(both) / f64::from((self.area + other.area - both).max(1))
    }

    /// Returns the indices of the cells inside.
    pub fn inside(&self) -> impl Iterator<Item = usize> {
        let bits = |word: u64| (0..64).filter(move |bit| word >> bit & 1 == 1);
        self.cells.iter().enumerate().flat_map(move |(at, &word)| bits(word).map(move |bit| at * 64 + bit))
    }

    /// Returns the logit of a cell.
    pub fn logit(&self, cell: usize) -> f32 {
        f32::from(self.logits[cell]) / LOGIT_STEPS
    }
}

/// Prompts at every grid point, on the network's threads. Returns the masks that pass the thresholds, without
/// duplicates, best first.
pub(crate) fn candidates(network: &Network, prepared: &PreparedPhoto, search: &Search) -> Result<Vec<Candidate>> {
    let (width, height) = prepared.frame.size;
    let points = search.grid * search.grid;
    let at = |point: usize| {
        let along = |index: usize, side: u32| (index as f32 + 0.5) * side as f32 / search.grid as f32;
        [along(point % search.grid, width), along(point / search.grid, height)]
    };
    let ask = |point: usize| -> Result<Vec<Candidate>> {
        let Answer { masks, scores } = network.ask(prepared, &Prompt::from_point(at(point)))?;
        let masks = masks.iter().zip(scores).map(|(mask, score)| Candidate::new(mask, score));
        let sure = |mask: &Candidate| mask.score > search.min_score && mask.stability > search.min_stability;
        Ok(masks.filter(|mask| mask.area > 0 && sure(mask)).collect())
    };
    let found: Vec<Vec<Candidate>> =
        parallel::map_bounded("", points, network.threads(), ask).into_iter().collect::<Result<_>>()?;
    Ok(without_duplicates(found.into_iter().flatten().collect()))
}

/// Returns the masks without duplicates of better ones, best first.
fn without_duplicates(mut masks: Vec<Candidate>) -> Vec<Candidate> {
    masks.sort_by(|a, b| b.quality().total_cmp(&a.quality()));
    let mut kept: Vec<Candidate> = Vec::new();
    for mask in masks {
        if kept.iter().all(|other| other.iou(&mask) <= DUPLICATE_IOU_MIN) {
            kept.push(mask);
        }
    }
    kept
}
