//! Merges the label ids of objects whose masks were made for each block separately.

use super::trained::TrainedBlock;
use crate::engine::Engine;
use crate::error::Result;
use crate::files::label_table::{LabelEntry, LabelTable, unique_name};
use crate::gpu::Gpu;
use crate::records::block_file::BlockFile;
use crate::render::{RenderOptions, render};
use crate::run::models;
use crate::scene::{LabelMap, UNLABELLED, View, Zone};
use crate::scenes::{LoadOptions, Lookup, open_logged};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// Fewest pixels that two ids must share over all common photos.
const PIXELS_MIN: u64 = 200;
/// Smallest ratio of the shared pixels to the pixels of the smaller id.
const SHARE_MIN: f64 = 0.5;

/// Masks whose ids agree within a block, but not between blocks.
#[derive(Clone, Copy)]
pub struct BlockMasks<'a> {
    /// The scene.
    pub scene: &'a Path,
    /// Folder with a subfolder of id masks per block, named like the block.
    pub masks: &'a Path,
    /// Opens the device that renders the overlap of two blocks.
    pub open: &'a dyn Fn() -> Result<Arc<Gpu>>,
}

/// A label id of a block: index of the block, and id in its masks.
type Node = (usize, u32);

/// Pixels that two ids of two blocks share.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SharedPixels {
    nodes: [Node; 2],
    pixels: u64,
}

/// Label ids of the merged model.
pub(super) struct JoinedIds {
    /// The new id of each id, by block.
    pub of: Vec<BTreeMap<u32, u32>>,
    /// Names of the new ids.
    pub names: LabelTable,
}

/// Finds ids of different blocks that are the same object. It compares the masks of both blocks in their common photos,
/// at pixels whose main Gaussian is in both zones.
pub(super) fn join(blocks: &Path, trained: &[&TrainedBlock], how: &BlockMasks) -> Result<JoinedIds> {
    let gpu = (how.open)()?;
    let mut found = Vec::new();
    for first in 0..trained.len() {
        found.extend(join_block(&gpu, blocks, first, trained, how)?);
    }
    let ids = ids_of(trained)?;
    Ok(numbered(&ids, &unions(found), trained))
}

/// Returns the names of the photos that two blocks share.
fn common(a: &TrainedBlock, b: &TrainedBlock) -> BTreeSet<String> {
    let own: BTreeSet<&String> = a.block.views.iter().collect();
    b.block.views.iter().filter(|name| own.contains(name)).cloned().collect()
}

fn views(trained: &TrainedBlock, only: BTreeSet<String>, how: &BlockMasks) -> Result<Vec<View>> {
    let options = LoadOptions {
        only: Some(Arc::new(only)),
        photos: false,
        lookup: Lookup { poses: trained.settings.read.poses, ..Lookup::default() },
        ..trained.settings.load_options(Some(how.masks.join(&trained.block.id)))
    };
    Ok(open_logged(how.scene, &options)?.train)
}

/// Compares a block with the later blocks that share photos with it.
fn join_block(
    gpu: &Arc<Gpu>,
    blocks: &Path,
    first: usize,
    trained: &[&TrainedBlock],
    how: &BlockMasks,
) -> Result<Vec<SharedPixels>> {
    let shared = (first + 1..trained.len()).map(|other| (other, common(trained[first], trained[other])));
    let shared: Vec<(usize, BTreeSet<String>)> = shared.filter(|(_, names)| !names.is_empty()).collect();
    if shared.is_empty() {
        return Ok(Vec::new());
    }
    let block = &trained[first].block;
    let model = models::open(&BlockFile::init(&blocks.join(&block.id)))?.gaussians;
    let mut engine = Engine::for_model(Arc::clone(gpu), &model, [(1, 1)])?;
    let zone = |of: &BlockFile| -> Zone { of.zone.zone(of.axes) };
    let mut found = Vec::new();
    for (other, names) in shared {
        let (own, theirs) = (views(trained[first], names.clone(), how)?, views(trained[other], names, how)?);
        let zones = [zone(block), zone(&trained[other].block)];
        let is_common: Vec<bool> =
            (0..model.len()).map(|row| zones.iter().all(|zone| zone.contains(model.world(row)))).collect();
        let mut counts = BTreeMap::new();
        for (own, theirs) in own.iter().zip(&theirs) {
            let (Some(a), Some(b)) = (own.mask()?, theirs.mask()?) else { continue };
            engine.grow_image(own.camera.width, own.camera.height)?;
            let drawn = render(&mut engine, &own.camera, &RenderOptions::for_main(block.near as f32))?;
            count(&mut counts, &drawn.top_id, &is_common, [&a, &b]);
        }
        found.extend(best(&counts, [first, other]));
    }
    Ok(found)
}

/// Counts the pixels of each id pair where the main Gaussian is in both zones.
fn count(counts: &mut BTreeMap<[u32; 2], u64>, tops: &[i32], is_common: &[bool], [a, b]: [&LabelMap; 2]) {
    for ((&top, &a), &b) in tops.iter().zip(&a.ids).zip(&b.ids) {
        if usize::try_from(top).is_ok_and(|row| is_common[row]) {
            *counts.entry([a.into(), b.into()]).or_default() += 1;
        }
    }
}

/// Returns the pairs of ids that are each other's best match and share enough pixels. 0 is not an id.
fn best(counts: &BTreeMap<[u32; 2], u64>, blocks: [usize; 2]) -> Vec<SharedPixels> {
    let mut totals = [BTreeMap::<u32, u64>::new(), BTreeMap::new()];
    let mut best = [BTreeMap::<u32, (u64, u32)>::new(), BTreeMap::new()];
    for (ids, &pixels) in counts {
        for side in 0..2 {
            *totals[side].entry(ids[side]).or_default() += pixels;
            // Ties go to the smaller id.
            let most = best[side].entry(ids[side]).or_insert((0, 0));
            if pixels > most.0 {
                *most = (pixels, ids[1 - side]);
            }
        }
    }
    let is_one = |(&[a, b], &pixels): (&[u32; 2], &u64)| {
        let less = totals[0][&a].min(totals[1][&b]);
        let enough = pixels >= PIXELS_MIN && pixels as f64 >= SHARE_MIN * less as f64;
        let mutual = best[0][&a].1 == b && best[1][&b].1 == a;
        (a != 0 && b != 0 && enough && mutual)
            .then_some(SharedPixels { nodes: [(blocks[0], a), (blocks[1], b)], pixels })
    };
    counts.iter().filter_map(is_one).collect()
}

/// Joins pairs in descending order of shared pixels. It never joins two ids of one block, because one wrong pair could
/// chain many objects. Returns the first id of the group for each grouped id.
fn unions(mut found: Vec<SharedPixels>) -> BTreeMap<Node, Node> {
    found.sort_by(|a, b| b.pixels.cmp(&a.pixels).then(a.nodes.cmp(&b.nodes)));
    let mut groups: Vec<BTreeSet<Node>> = Vec::new();
    for SharedPixels { nodes, .. } in found {
        let at = nodes.map(|node| groups.iter().position(|group| group.contains(&node)));
        let joint: BTreeSet<Node> =
            at.into_iter().flatten().flat_map(|at| groups[at].iter().copied()).chain(nodes).collect();
        let blocks: BTreeSet<usize> = joint.iter().map(|(block, _)| *block).collect();
        if blocks.len() < joint.len() {
            tracing::warn!(
                "ids {} and {} overlap, but joining them would join two ids of one block",
                nodes[0].1,
                nodes[1].1
            );
            continue;
        }
        let others = groups.into_iter().enumerate().filter(|(index, _)| !at.contains(&Some(*index)));
        groups = others.map(|(_, group)| group).chain([joint]).collect();
    }
    let of =
        |group: &BTreeSet<Node>| group.iter().map(|&node| (node, *group.first().unwrap_or(&node))).collect::<Vec<_>>();
    groups.iter().flat_map(of).collect()
}

/// Returns the ids of the Gaussians that the merged model takes from each block.
fn ids_of(trained: &[&TrainedBlock]) -> Result<Vec<BTreeSet<u32>>> {
    let of = |trained: &&TrainedBlock| {
        let labels = trained.core()?.labels.unwrap_or_default();
        Ok(labels.into_iter().filter(|&label| label != UNLABELLED).collect())
    };
    trained.iter().map(of).collect()
}

/// Numbers the groups by their first block and id, from 1.
fn numbered(ids: &[BTreeSet<u32>], groups: &BTreeMap<Node, Node>, trained: &[&TrainedBlock]) -> JoinedIds {
    let mut numbers: BTreeMap<Node, u32> = BTreeMap::new();
    let (mut entries, mut taken) = (Vec::new(), BTreeSet::new());
    let mut of = Vec::new();
    for (block, ids) in ids.iter().enumerate() {
        let mut map = BTreeMap::new();
        for &id in ids {
            let first = *groups.get(&(block, id)).unwrap_or(&(block, id));
            let next = numbers.len() as u32 + 1;
            let number = *numbers.entry(first).or_insert(next);
            if number == next {
                let name = trained[block].names.as_ref().and_then(|table| table.name(id)).map(str::to_owned);
                entries.push(LabelEntry {
                    name: name.map(|name| unique_name(name, &mut taken)),
                    ..LabelEntry::new(number)
                });
            }
            map.insert(id, number);
        }
        of.push(map);
    }
    JoinedIds { of, names: LabelTable::new(entries) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(nodes: [Node; 2], pixels: u64) -> SharedPixels {
        SharedPixels { nodes, pixels }
    }

    #[test]
    fn only_mutual_best_pairs_with_enough_pixels_count() {
        let counts = [
            ([1, 7], 900),
            // The best match of 2 is 7, whose best match is 1.
            ([2, 7], 500),
            ([2, 8], 100),
            // Too few pixels; then less than half of the smaller id.
            ([3, 9], 150),
            ([4, 10], 300),
            ([4, 0], 200),
            ([0, 10], 500),
            ([5, 11], 250),
        ];
        let counts: BTreeMap<[u32; 2], u64> = counts.into_iter().collect();
        assert_eq!(best(&counts, [0, 1]), [pair([(0, 1), (1, 7)], 900), pair([(0, 5), (1, 11)], 250)]);
    }

    #[test]
    fn groups_span_blocks_and_never_hold_two_ids_of_one() {
        // One object in four blocks, and a wrong pair that would join two objects.
        let found = vec![
            pair([(0, 1), (1, 5)], 800),
            pair([(1, 5), (2, 3)], 700),
            pair([(2, 3), (3, 9)], 600),
            pair([(0, 2), (3, 8)], 900),
            pair([(0, 2), (3, 9)], 300),
        ];
        let groups = unions(found);
        for node in [(0, 1), (1, 5), (2, 3), (3, 9)] {
            assert_eq!(groups[&node], (0, 1));
        }
        assert_eq!((groups[&(0, 2)], groups[&(3, 8)]), ((0, 2), (0, 2)));
    }
}
