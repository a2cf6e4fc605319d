//! Specks of a label map: small regions inside another label that the ground truth does not have.

use crate::scene::LabelMap;

/// Smallest region that is not a speck, px.
const REGION_PIXELS_MIN: usize = 12;

/// Counts specks: edge-connected regions of one id (or 0) with fewer than 12 px, enclosed by a single other id, of
/// which at least half the pixels have another id in `truth`. Both maps have the same size.
pub fn specks(map: &LabelMap, truth: &LabelMap) -> u64 {
    let mut done = vec![false; map.ids.len()];
    let mut specks = 0;
    for start in 0..map.ids.len() {
        if done[start] {
            continue;
        }
        let id = map.ids[start];
        let (mut region, mut around) = (vec![start], Vec::new());
        done[start] = true;
        let mut at = 0;
        while let Some(&index) = region.get(at) {
            for (other, by_edge) in neighbours(map, index) {
                if map.ids[other] != id {
                    around.push(map.ids[other]);
                } else if by_edge && !done[other] {
                    done[other] = true;
                    region.push(other);
                }
            }
            at += 1;
        }
        let inside_one = !around.is_empty() && around.iter().all(|&other| other == around[0]);
        let right = region.iter().filter(|&&index| truth.ids[index] == id).count();
        specks += u64::from(region.len() < REGION_PIXELS_MIN && inside_one && 2 * right <= region.len());
    }
    specks
}

/// Returns the up to 8 neighbours of a pixel, and whether they share an edge with it.
fn neighbours(map: &LabelMap, index: usize) -> impl Iterator<Item = (usize, bool)> {
    let (width, height) = (map.width as usize, map.height as usize);
    let (x, y) = (index % width, index / width);
    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
    rows.flat_map(move |row| {
        let columns = x.saturating_sub(1)..=(x + 1).min(width - 1);
        columns.map(move |column| (row * width + column, row == y || column == x))
    })
}
