//! Chooses the photos of each block, with one render of the coarse model per photo.

use super::cells::Cell;
use super::coarse::CoarseModel;
use super::frame::Frame;
use crate::engine::Engine;
use crate::error::Result;
use crate::records::block_file::Bounds;
use crate::scene::{Camera, View, Zone};
use crate::train::strategy::weights::weights;
use glam::{DVec2, DVec3};

/// Smallest share of a photo's blending weight from the core for the photo to be chosen.
const CORE_WEIGHT_SHARE_MIN: f64 = 0.02;
/// The same for the zone, if the camera is inside the zone.
const ZONE_WEIGHT_SHARE_MIN: f64 = 0.01;
/// Smallest share of the image that the core's box covers for the photo to be chosen. Such a photo would show floaters
/// in the empty part of the box.
const BOX_IMAGE_SHARE_MIN: f64 = 0.25;
/// Rays cast along the longer image side to measure that share.
const RAYS_PER_LONG_SIDE: u32 = 24;

/// The photos of a block, and which coarse Gaussians they show.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockPhotos {
    /// Indices of training views, each with the core's share of its weight, in view order.
    pub train: Vec<(usize, f64)>,
    /// Indices of held-out views.
    pub test: Vec<usize>,
    /// For each coarse Gaussian, whether a chosen training view shows it.
    pub is_seen: Vec<bool>,
}

/// A block in the ground frame.
struct Block<'a> {
    cell: &'a Cell,
    zone: Zone,
    /// Box of its Gaussians without outliers.
    inside: Zone,
    /// Rows in the zone but not in the core.
    margin: Vec<usize>,
}

/// Chooses the photos of each cell.
pub(super) fn choose(
    engine: &mut Engine,
    coarse: &CoarseModel,
    frame: &Frame,
    cells: &[Cell],
) -> Result<Vec<BlockPhotos>> {
    let blocks: Vec<Block> = cells.iter().map(|cell| Block::new(cell, frame, coarse)).collect();
    let count = coarse.model.len();
    let mut chosen = vec![BlockPhotos { is_seen: vec![false; count], ..BlockPhotos::default() }; cells.len()];
    let (train, test) = (&coarse.dataset.train, &coarse.dataset.test);
    for (index, view) in train.iter().chain(test).enumerate() {
        let found = weights(engine, std::iter::once((&view.camera, coarse.near)))?;
        for (block, chosen) in blocks.iter().zip(&mut chosen) {
            let Some(share) = block.takes(view, &found) else { continue };
            if index >= train.len() {
                chosen.test.push(index - train.len());
                continue;
            }
            chosen.train.push((index, share));
            chosen.is_seen.iter_mut().zip(&found).for_each(|(seen, &weight)| *seen |= weight > 0.0);
        }
    }
    Ok(chosen)
}

impl<'a> Block<'a> {
    fn new(cell: &'a Cell, frame: &Frame, coarse: &CoarseModel) -> Self {
        let zone = frame.zone(&cell.zone());
        let sides = |end: usize| cell.inside[end].to_array().map(Some);
        let inside = frame.zone(&Bounds { low: sides(0), high: sides(1) });
        let is_core = |row: usize| cell.rows.binary_search(&row).is_ok();
        let margin =
            coarse.near_rows.iter().copied().filter(|&row| !is_core(row) && zone.contains(coarse.model.world(row)));
        Self { cell, zone, inside, margin: margin.collect() }
    }

    /// Returns the core's share of a photo's weight, or `None` if the photo is not chosen. `weights` has one entry per
    /// coarse Gaussian.
    fn takes(&self, view: &View, weights: &[f32]) -> Option<f64> {
        let sum = |rows: &mut dyn Iterator<Item = f32>| rows.map(f64::from).sum::<f64>();
        let all = sum(&mut weights.iter().copied());
        if all <= 0.0 {
            return None;
        }
        let core = sum(&mut self.cell.rows.iter().map(|&row| weights[row])) / all;
        let zone = core + sum(&mut self.margin.iter().map(|&row| weights[row])) / all;
        let stands_in = self.zone.contains(view.camera.centre());
        let is_taken = core >= CORE_WEIGHT_SHARE_MIN
            || (stands_in && zone >= ZONE_WEIGHT_SHARE_MIN)
            || seen_share(&view.camera, &self.inside) >= BOX_IMAGE_SHARE_MIN;
        is_taken.then_some(core)
    }
}

/// Returns the share of the image rays that pass through a box.
fn seen_share(camera: &Camera, zone: &Zone) -> f64 {
    let longest = camera.width.max(camera.height);
    let count = |side: u32| (side * RAYS_PER_LONG_SIDE).div_ceil(longest).max(1);
    let (columns, rows) = (count(camera.width), count(camera.height));
    let from = zone.to_axes(camera.centre());
    let hits = (0..rows * columns).filter(|at| {
        let share = |index: u32, count: u32, side: u32| (f64::from(index) + 0.5) / f64::from(count) * f64::from(side);
        let pixel = DVec2::new(share(at % columns, columns, camera.width), share(at / columns, rows, camera.height));
        passes(from, zone.to_axes(camera.rotation.transpose() * camera.ray(pixel)), zone)
    });
    hits.count() as f64 / f64::from(rows * columns)
}

/// Returns true if a ray, given along the box axes, hits the box.
fn passes(from: DVec3, along: DVec3, zone: &Zone) -> bool {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if !(zone.low[axis]..zone.high[axis]).contains(&from[axis]) {
                return false;
            }
            continue;
        }
        let ends = [zone.low[axis], zone.high[axis]].map(|side| (side - from[axis]) / along[axis]);
        enter = enter.max(ends[0].min(ends[1]));
        leave = leave.min(ends[0].max(ends[1]));
    }
    enter < leave
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn the_share_of_a_box_in_a_picture() {
        let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
        let camera =
            Camera { rotation, translation, fx: 100.0, fy: 100.0, cx: 50.0, cy: 50.0, width: 100, height: 100 };
        let share = |corners| seen_share(&camera, &Zone::along_world(corners));
        assert_eq!(share([-9.0, -9.0, 1.0, 9.0, 9.0, 2.0]), 1.0, "before the camera");
        assert_eq!(share([-9.0, -9.0, -2.0, 9.0, 9.0, -1.0]), 0.0, "behind it");
        assert_eq!(share([0.0, -9.0, 2.0, 9.0, 9.0, 3.0]), 0.5, "the right half");
        assert_eq!(share([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]), 1.0, "the camera stands in it");
    }
}
