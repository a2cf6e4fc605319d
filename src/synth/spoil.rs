//! Adds tracker faults to masks, to measure their effect.

use super::hash01;
use labelgs_scene::LabelMap;
use std::collections::{BTreeMap, BTreeSet};

/// Factor by which trackers shrink photos: 1080 to 480 lines.
const TRACKER_SHRINK: f64 = 2.25;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Fault {
    /// Swap the ids of two objects in some views.
    Swap,
    /// Shrink masks by a factor of 2.25 and enlarge them again.
    Coarse,
    /// Give every view except the first its own ids, as a single-image segmenter does.
    PerView,
    /// Leave out the masks of some views.
    Missing,
    /// Give an object the id of another object in some views.
    Merge,
}

/// Returns the masks with a fault; `None` is a missing mask. The fault affects a `share` of the views, drawn by `seed`.
pub fn spoil(masks: &[LabelMap], fault: Fault, share: f64, seed: u64) -> Vec<Option<LabelMap>> {
    let objects: Vec<u16> = masks.iter().flat_map(LabelMap::objects).collect::<BTreeSet<u16>>().into_iter().collect();
    let random = |view: usize, number: u64| hash01(seed, view as u64, number, 0x5b011);
    // The number of views is exact up to rounding, whatever the random numbers.
    let mut order: Vec<usize> = (0..masks.len()).collect();
    order.sort_by(|&a, &b| random(a, 0).total_cmp(&random(b, 0)).then(a.cmp(&b)));
    let drawn: BTreeSet<usize> = order.into_iter().take((share * masks.len() as f64).round() as usize).collect();
    let pick = |from: &[u16], view: usize, number: u64| {
        from.get((random(view, number) * from.len() as f64) as usize).copied().unwrap_or(0)
    };
    let one = |(view, mask): (usize, &LabelMap)| {
        let here = mask.objects();
        let hit = drawn.contains(&view);
        match fault {
            Fault::Swap if hit => {
                let first = pick(&here, view, 1);
                let others: Vec<u16> = here.iter().copied().filter(|&id| id != first).collect();
                let second = pick(&others, view, 2);
                Some(with_ids(mask, &[(first, second), (second, first)].into()))
            }
            Fault::Coarse => Some(coarse(mask)),
            Fault::PerView if view > 0 => {
                let mut ids: Vec<u16> = (1..=objects.len() as u16 * 4).collect();
                ids.sort_by(|&a, &b| random(view, u64::from(a)).total_cmp(&random(view, u64::from(b))));
                Some(with_ids(mask, &here.iter().copied().zip(ids).collect()))
            }
            Fault::Missing if hit => None,
            Fault::Merge if hit && objects.len() > 1 => {
                let first = pick(&objects, masks.len(), 1);
                let others: Vec<u16> = objects.iter().copied().filter(|&id| id != first).collect();
                Some(with_ids(mask, &[(first, pick(&others, masks.len(), 2))].into()))
            }
            _ => Some(mask.clone()),
        }
    };
    masks.iter().enumerate().map(one).collect()
}

fn with_ids(mask: &LabelMap, new: &BTreeMap<u16, u16>) -> LabelMap {
    // 0 stays 0, even if a view has too few objects to choose from.
    let id = |&id: &u16| if id == 0 { 0 } else { new.get(&id).copied().filter(|&id| id != 0).unwrap_or(id) };
    LabelMap { ids: mask.ids.iter().map(id).collect(), ..mask.clone() }
}

fn coarse(mask: &LabelMap) -> LabelMap {
    let (width, height) = (f64::from(mask.width), f64::from(mask.height));
    let middle =
        |at: u32, size: f64| (((f64::from(at) / TRACKER_SHRINK).floor() + 0.5) * TRACKER_SHRINK).min(size - 1.0) as u32;
    let pixels = (0..mask.height).flat_map(|y| (0..mask.width).map(move |x| (x, y)));
    LabelMap { ids: pixels.map(|(x, y)| mask.at(middle(x, width), middle(y, height))).collect(), ..mask.clone() }
}
