//! Repairs inconsistent masks through the model that all masks labelled.

use super::associate::{SAME_OBJECT_OVERLAP_MIN, Segment};
use crate::scene::LabelMap;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// If one object has more than this share of a mask, the whole mask becomes that object. Otherwise the mask covers
/// several objects, and is divided along the model's object borders.
const ONE_OBJECT_SHARE_MIN: f64 = 0.85;
/// Smallest share of a mask that is split off as another object; a smaller share is only a shifted border.
const PART_SHARE_MIN: f64 = 0.05;
/// An object counts as missing in a view if more than this share of its rendered pixels is outside of all masks.
const MISSED_SHARE_MIN: f64 = 0.6;
/// Smallest area to split off or fill in, as a share of the image. Smaller areas are borders, not objects.
const AREA_SHARE_MIN: f64 = 0.0005;

/// How objects get their ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// The most frequent id of the object's pixels in the masks; conflicting objects get the next free ids.
    Majority,
    /// 1, 2, ... by size, for views with unrelated ids.
    Fresh,
}

/// The changes to the masks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Masks with a new id: view, old id, new id.
    pub renamed: Vec<(Segment, u16)>,
    /// Masks of objects that too few views show; their pixels are now 0.
    pub left_out: Vec<Segment>,
    /// Divided masks, with the ids of their parts.
    pub divided: Vec<(Segment, Vec<u16>)>,
    /// Objects that were missing in a view: view and id.
    pub filled: Vec<Segment>,
    /// Views whose mask was made from the model.
    pub made: Vec<usize>,
}

impl Repairs {
    /// Converts the ids after a first renaming by `names` back to the original ids; `all` are the masks.
    pub(super) fn trace(&mut self, names: &BTreeMap<Segment, u16>, all: impl Iterator<Item = Segment>) {
        let first: BTreeMap<Segment, u16> = names.iter().map(|(&(view, old), &new)| ((view, new), old)).collect();
        let old = |(view, id): Segment| (view, first.get(&(view, id)).copied().unwrap_or(id));
        let mut renamed = names.clone();
        renamed.extend(self.renamed.drain(..).map(|(segment, new)| (old(segment), new)));
        for (segment, _) in &mut self.divided {
            *segment = old(*segment);
            renamed.remove(segment);
        }
        self.renamed = renamed.into_iter().filter(|((_, old), new)| old != new).collect();
        self.left_out = all.filter(|segment| !names.contains_key(segment)).collect();
    }
}

/// Returns the id of each mask, given its group.
pub fn name_groups(groups: &[Vec<Segment>], pixels: &BTreeMap<Segment, u64>, naming: Naming) -> BTreeMap<Segment, u16> {
    let area = |group: &[Segment]| group.iter().map(|segment| pixels.get(segment).copied().unwrap_or(0)).sum::<u64>();
    let mut by_size: Vec<usize> = (0..groups.len()).collect();
    by_size.sort_by_key(|&group| (Reverse(area(&groups[group])), groups[group][0]));
    let mut names: BTreeMap<usize, u16> = BTreeMap::new();
    let mut taken: BTreeSet<u16> = BTreeSet::new();
    if naming == Naming::Majority {
        let mut claims: BTreeMap<(usize, u16), u64> = BTreeMap::new();
        for (group, segments) in groups.iter().enumerate() {
            for segment in segments {
                *claims.entry((group, segment.1)).or_default() += pixels.get(segment).copied().unwrap_or(0);
            }
        }
        let mut claims: Vec<((usize, u16), u64)> = claims.into_iter().collect();
        claims.sort_by_key(|&(claim, pixels)| (Reverse(pixels), claim));
        for ((group, id), _) in claims {
            if !names.contains_key(&group) && taken.insert(id) {
                names.insert(group, id);
            }
        }
    }
    let mut free = (1..=u16::MAX).filter(|id| !taken.contains(id));
    for group in by_size {
        if !names.contains_key(&group)
            && let Some(id) = free.next()
        {
            names.insert(group, id);
        }
    }
    let named = |(group, segments): (usize, &Vec<Segment>)| {
        let id = names.get(&group).copied().unwrap_or(0);
        segments.iter().map(move |&segment| (segment, id)).collect::<Vec<_>>()
    };
    groups.iter().enumerate().flat_map(named).collect()
}

/// Returns the mask with its groups' ids.
pub fn rename(view: usize, mask: &LabelMap, names: &BTreeMap<Segment, u16>) -> LabelMap {
    let new: BTreeMap<u16, u16> =
        mask.objects().into_iter().map(|id| (id, names.get(&(view, id)).copied().unwrap_or(0))).collect();
    let ids = mask.ids.iter().map(|id| new.get(id).copied().unwrap_or(0)).collect();
    LabelMap { ids, ..mask.clone() }
}

/// For each id of a mask, its pixel counts by the object that the model shows there, 0 for none.
fn shown_by_id(mask: &LabelMap, shown: &LabelMap) -> BTreeMap<u16, BTreeMap<u16, u64>> {
    let mut counts: BTreeMap<u16, BTreeMap<u16, u64>> = BTreeMap::new();
    for (&id, &object) in mask.ids.iter().zip(&shown.ids) {
        *counts.entry(id).or_default().entry(object).or_default() += 1;
    }
    counts
}

/// Returns the pixels at which the model shows an object.
fn area(counts: &BTreeMap<u16, BTreeMap<u16, u64>>, object: u16) -> u64 {
    counts.values().filter_map(|seen| seen.get(&object)).sum()
}

/// Returns the object with the most pixels, and its pixel count; ties go to the smaller id.
fn most_frequent(objects: &BTreeMap<u16, u64>) -> Option<(u16, u64)> {
    let objects = objects.iter().map(|(&object, &pixels)| (object, pixels)).filter(|(object, _)| *object != 0);
    objects.max_by_key(|&(object, pixels)| (pixels, Reverse(object)))
}

/// Repairs a renamed mask by the rendered labels of its view. Divides masks that cover several objects, corrects the
/// ids of others, and fills in missing objects.
pub fn mend(view: usize, mask: &LabelMap, shown: &LabelMap, repairs: &mut Repairs) -> LabelMap {
    let smallest = (AREA_SHARE_MIN * mask.ids.len() as f64).max(4.0) as u64;
    let counts = shown_by_id(mask, shown);
    let mut out = mask.clone();
    for (&id, seen) in counts.iter().filter(|(id, _)| **id != 0) {
        let total: u64 = seen.iter().filter(|(object, _)| **object != 0).map(|(_, &pixels)| pixels).sum();
        let least = smallest.max((PART_SHARE_MIN * total as f64) as u64);
        let objects: BTreeMap<u16, u64> =
            seen.iter().map(|(&object, &pixels)| (object, pixels)).filter(|at| at.0 != 0 && at.1 >= least).collect();
        let Some((most, pixels)) = most_frequent(&objects) else { continue };
        if pixels as f64 >= ONE_OBJECT_SHARE_MIN * total as f64 {
            if most != id {
                repairs.renamed.push(((view, id), most));
                recolour(&mut out, mask, id, |_| most);
            }
            continue;
        }
        repairs.divided.push(((view, id), objects.keys().copied().collect()));
        recolour(&mut out, mask, id, |at| if objects.contains_key(&shown.ids[at]) { shown.ids[at] } else { most });
    }
    let nothing = counts.get(&0).into_iter().flatten();
    for (&object, &pixels) in nothing.filter(|(object, _)| **object != 0) {
        if pixels >= smallest && pixels as f64 >= MISSED_SHARE_MIN * area(&counts, object) as f64 {
            repairs.filled.push((view, object));
            for (at, to) in out.ids.iter_mut().enumerate() {
                if mask.ids[at] == 0 && shown.ids[at] == object {
                    *to = object;
                }
            }
        }
    }
    out
}

/// Gives a view's masks the ids of the objects that the model shows there; outlines stay unchanged. A mask without a
/// rendered object keeps its id if it is one of `objects`, because a model may show less of an object than its mask.
pub fn adopt(
    view: usize,
    mask: &LabelMap,
    shown: &LabelMap,
    objects: &BTreeSet<u16>,
    repairs: &mut Repairs,
) -> LabelMap {
    let counts = shown_by_id(mask, shown);
    let mut out = mask.clone();
    for (&id, seen) in counts.iter().filter(|(id, _)| **id != 0) {
        let total: u64 = seen.values().sum();
        let new = match most_frequent(seen) {
            Some((object, pixels))
                if pixels as f64 >= SAME_OBJECT_OVERLAP_MIN * total.min(area(&counts, object)) as f64 =>
            {
                object
            }
            _ if objects.contains(&id) => id,
            _ => 0,
        };
        if new == 0 {
            repairs.left_out.push((view, id));
        } else if new != id {
            repairs.renamed.push(((view, id), new));
        }
        recolour(&mut out, mask, id, |_| new);
    }
    out
}

/// Replaces `id` by the new id at each pixel.
fn recolour(out: &mut LabelMap, mask: &LabelMap, id: u16, new: impl Fn(usize) -> u16) {
    for (at, to) in out.ids.iter_mut().enumerate().filter(|(at, _)| mask.ids[*at] == id) {
        *to = new(at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_of_which_the_model_shows_a_part_is_its_object() {
        let map = |ids: &[u16]| LabelMap { width: ids.len() as u32, height: 1, ids: ids.to_vec() };
        let mask = map(&[7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 8, 8, 8, 8, 9, 9, 0, 0, 0, 0]);
        // The first mask is one tenth covered by its only object; the second includes a row of its neighbour.
        let shown = map(&[3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 4, 4, 4, 4, 4, 0]);
        let mut repairs = Repairs::default();
        let found = adopt(5, &mask, &shown, &BTreeSet::new(), &mut repairs);
        assert_eq!(found.ids, [3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 0, 0, 0, 0]);
        assert_eq!(repairs.renamed, [((5, 7), 3), ((5, 8), 4), ((5, 9), 4)]);
        let found = adopt(5, &mask, &map(&[0; 20]), &BTreeSet::from([8]), &mut Repairs::default());
        assert_eq!(found.ids, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn repairs_are_told_by_the_ids_that_masks_had() {
        let names = BTreeMap::from([((0, 3), 1), ((0, 1), 3), ((0, 5), 5), ((1, 2), 4)]);
        let mut repairs = Repairs {
            // After the first renaming: 3 was 1, 5 is unchanged, 4 was 2.
            renamed: vec![((0, 3), 1), ((0, 5), 6)],
            divided: vec![((1, 4), vec![4, 7])],
            ..Repairs::default()
        };
        repairs.trace(&names, [(0, 1), (0, 3), (0, 5), (0, 8), (1, 2)].into_iter());
        assert_eq!(repairs.renamed, [((0, 3), 1), ((0, 5), 6)], "1 became 3 and 1 again");
        assert_eq!((repairs.divided, repairs.left_out), (vec![((1, 2), vec![4, 7])], vec![(0, 8)]));
    }
}
