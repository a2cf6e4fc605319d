//! All masks that a network finds in a photo when it is asked at every point of a grid.

use super::network::{Answer, Network, Prepared};
use super::prompt::Prompt;
use labelgs_masks::nested::quality;
use labelgs_scene::{Result, parallel};

/// Steps of a stored logit per unit.
const LOGIT_STEPS: f32 = 16.0;
/// Distance of the two levels of logits whose areas tell how stable a mask is, as in Segment Anything.
const STABLE_LOGIT: f32 = 1.0;
/// IoU above which two masks are the same.
const DOUBLE_IOU: f64 = 0.7;

/// The options for finding masks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Points of the grid per side.
    pub grid: usize,
    /// Least score by the network's own word.
    pub min_score: f32,
    /// Least stability, 0 to 1.
    pub min_stability: f32,
}

/// A mask on the grid of the network.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// The cells inside, a bit each, row by row.
    cells: Vec<u64>,
    /// Logits in steps.
    logits: Vec<i8>,
    /// Number of cells inside.
    pub area: u32,
    /// What the network expects of its IoU with an object.
    pub score: f32,
    /// IoU of the mask cut at a higher and at a lower logit.
    pub stability: f32,
}

impl Candidate {
    /// Makes a mask from logits.
    pub fn new(logits: &[f32], score: f32) -> Self {
        let mut cells = vec![0; logits.len().div_ceil(64)];
        for (at, _) in logits.iter().enumerate().filter(|(_, logit)| **logit > 0.0) {
            cells[at / 64] |= 1 << (at % 64);
        }
        let above = |level: f32| logits.iter().filter(|logit| **logit > level).count() as f32;
        let stability = above(STABLE_LOGIT) / above(-STABLE_LOGIT).max(1.0);
        let steps = logits.iter().map(|logit| (logit * LOGIT_STEPS).round().clamp(-128.0, 127.0) as i8).collect();
        let area = cells.iter().map(|word: &u64| word.count_ones()).sum();
        Self { cells, logits: steps, area, score, stability }
    }

    /// Returns the number of cells of the photo, inside or not.
    pub fn cells(&self) -> usize {
        self.logits.len()
    }

    /// Returns how far the network is to be trusted, 0 to 1.
    pub fn quality(&self) -> f64 {
        quality(f64::from(self.score.clamp(0.0, 1.0) * self.stability))
    }

    /// Returns the number of cells inside of both.
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

/// Asks at every point of the grid, on the threads of the network, and returns the masks that are sure enough, each once,
/// the best first.
pub(crate) fn candidates(network: &Network, prepared: &Prepared, search: &Search) -> Result<Vec<Candidate>> {
    let (width, height) = prepared.frame.size;
    let points = search.grid * search.grid;
    let at = |point: usize| {
        let along = |index: usize, side: u32| (index as f32 + 0.5) * side as f32 / search.grid as f32;
        [along(point % search.grid, width), along(point / search.grid, height)]
    };
    let ask = |point: usize| -> Result<Vec<Candidate>> {
        let Answer { masks, scores } = network.ask(prepared, &Prompt::at(at(point)))?;
        let masks = masks.iter().zip(scores).map(|(mask, score)| Candidate::new(mask, score));
        let sure = |mask: &Candidate| mask.score > search.min_score && mask.stability > search.min_stability;
        Ok(masks.filter(|mask| mask.area > 0 && sure(mask)).collect())
    };
    let found: Vec<Vec<Candidate>> =
        parallel::map_bounded("", points, network.threads(), ask).into_iter().collect::<Result<_>>()?;
    Ok(without_doubles(found.into_iter().flatten().collect()))
}

/// Returns the masks of which none is the double of a better one, the best first.
fn without_doubles(mut masks: Vec<Candidate>) -> Vec<Candidate> {
    masks.sort_by(|a, b| b.quality().total_cmp(&a.quality()));
    let mut kept: Vec<Candidate> = Vec::new();
    for mask in masks {
        if kept.iter().all(|other| other.iou(&mask) <= DOUBLE_IOU) {
            kept.push(mask);
        }
    }
    kept
}
