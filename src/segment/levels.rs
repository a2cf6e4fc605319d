//! Nested masks of a photo as levels: ids for parts, objects and wholes.

use super::candidate::{Candidate, Search, candidates};
use super::features::Features;
use super::network::Network;
use labelgs_masks::explain;
use labelgs_masks::nested::FoundMask;
use labelgs_scene::{LabelMap, Result};
use std::collections::BTreeSet;

/// Largest share of a photo that a whole may cover; larger masks are surroundings.
const WHOLE_SHARE_MAX: f64 = 0.4;

/// Which of the nested masks a pixel belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The smallest mask.
    Parts,
    /// The mask that explains more than its parts do together.
    Objects,
    /// The largest mask that is not part of the surroundings.
    Wholes,
}

/// The masks of a photo.
#[derive(Clone, Debug)]
pub struct PhotoMasks {
    /// All masks, best first.
    pub masks: Vec<FoundMask>,
    /// An id map from 1 for each requested level.
    pub levels: Vec<LabelMap>,
}

/// Finds the masks of a photo, and paints those of each level at a size, px.
pub fn masks_of_photo(
    network: &Network,
    features: &Features,
    search: &Search,
    levels: &[Level],
    size: (u32, u32),
) -> Result<PhotoMasks> {
    let prepared = network.prepare(features)?;
    let candidates = candidates(network, &prepared, search)?;
    let inside: Vec<Vec<bool>> =
        candidates.iter().map(|mask| prepared.frame.drawn(&|cell| mask.logit(cell), size)).collect();
    let paint = |&level: &Level| {
        let chosen: Vec<&[bool]> =
            of_level(&candidates, level).into_iter().map(|mask| inside[mask].as_slice()).collect();
        painted(&chosen, size)
    };
    let levels = levels.iter().map(paint).collect();
    let found = candidates.iter().zip(inside).map(|(mask, inside)| FoundMask {
        inside,
        score: mask.score,
        stability: mask.stability,
    });
    // Ignore masks without a pixel at this size.
    Ok(PhotoMasks { masks: found.filter(|mask| mask.inside.contains(&true)).collect(), levels })
}

/// Returns the indices of a level's masks, with those on top last.
fn of_level(masks: &[Candidate], level: Level) -> Vec<usize> {
    let mut by_area: Vec<usize> = (0..masks.len()).collect();
    by_area.sort_by_key(|&mask| (std::cmp::Reverse(masks[mask].area), mask));
    match level {
        Level::Parts => by_area,
        Level::Objects => {
            let chosen = objects(masks);
            by_area.into_iter().filter(|mask| chosen.contains(mask)).collect()
        }
        Level::Wholes => {
            let largest = masks.first().map_or(0.0, |mask| WHOLE_SHARE_MAX * mask.cells() as f64);
            by_area.into_iter().rev().filter(|&mask| f64::from(masks[mask].area) < largest).collect()
        }
    }
}

/// Chooses objects among nested masks.
fn objects(masks: &[Candidate]) -> BTreeSet<usize> {
    let areas: Vec<f64> = masks.iter().map(|mask| f64::from(mask.area)).collect();
    let qualities: Vec<f64> = masks.iter().map(Candidate::quality).collect();
    let pairs = (0..masks.len()).flat_map(|a| (a + 1..masks.len()).map(move |b| (a, b)));
    let shared = pairs.map(|(a, b)| ((a, b), f64::from(masks[a].shared(&masks[b]))));
    let parts = explain::parts_of(&areas, shared);
    explain::objects(&areas, &qualities, &parts, |chosen| explained(masks, chosen))
}

/// Returns the sum over cells of the best mask quality there.
fn explained(masks: &[Candidate], chosen: &BTreeSet<usize>) -> f64 {
    let mut best = vec![0.0_f64; masks.first().map_or(0, Candidate::cells)];
    for &mask in chosen {
        let quality = masks[mask].quality();
        masks[mask].inside().for_each(|cell| best[cell] = best[cell].max(quality));
    }
    best.iter().sum()
}

/// Paints masks as ids from 1, later ones on top. Fully covered masks get no id.
fn painted(masks: &[&[bool]], (width, height): (u32, u32)) -> LabelMap {
    let mut top = vec![0_usize; (width * height) as usize];
    for (mask, number) in masks.iter().zip(1..) {
        top.iter_mut().zip(*mask).filter(|(_, inside)| **inside).for_each(|(top, _)| *top = number);
    }
    let seen: BTreeSet<usize> = top.iter().copied().filter(|&number| number != 0).collect();
    let mut ids = vec![0_u16; masks.len() + 1];
    // Masks beyond the largest id are dropped; they are the smallest.
    seen.iter().zip(1..=u16::MAX).for_each(|(&number, id)| ids[number] = id);
    LabelMap { width, height, ids: top.into_iter().map(|number| ids[number]).collect() }
}
