//! The grid of signed distances to a surface, and its triangles.

use super::sights::{BoundingBall, DepthPicture};
use crate::formats::Mesh;
use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::DVec3;
use rayon::prelude::*;

/// Margin around the object's box, cells.
const MARGIN_CELLS: f64 = 3.0;
/// Largest distance in front of a surface that is stored, cells; cells farther in front are only free.
const FRONT_MAX_CELLS: f64 = 3.0;
/// Largest distance behind a surface that is stored, cells: smaller, because the other side of a thin wall may be
/// there.
const BEHIND_MAX_CELLS: f64 = 1.5;
/// How far the surface may be outside of the box of its visible part, cells.
const BOX_SLACK_CELLS: f64 = 0.5;
/// Weight of a picture in which a cell is free, or at another object's surface, relative to a picture that shows the
/// surface frontally.
const FREE_WEIGHT: f64 = 0.006;
/// The same for a picture in which the cell is behind the object, or behind something else.
const HIDDEN_WEIGHT: f64 = 0.01;
/// The same for the prior that a cell is inside.
const INSIDE_WEIGHT: f64 = 1e-4;
/// Smallest part of the object to keep, relative to its largest part.
const PART_SIZE_SHARE_MIN: f64 = 0.01;
/// Smallest cosine between ray and surface normal at which depth counts.
const COSINE_MIN: f32 = 0.1;

/// A grid around an object.
#[derive(Debug)]
pub(super) struct Volume {
    /// Bounding box of the visible part of the object.
    seen: (DVec3, DVec3),
    low: DVec3,
    /// Cell size, world units.
    cell: f64,
    /// Cell corners along each axis.
    size: [u32; 3],
}

impl Volume {
    /// Makes a grid around a box, with `cells` cells along its longest side.
    pub(super) fn around(low: DVec3, high: DVec3, cells: u32) -> Self {
        let cell = ((high - low).max_element() / f64::from(cells)).max(f64::MIN_POSITIVE);
        let count = |axis: usize| ((high - low)[axis] / cell + 2.0 * MARGIN_CELLS).ceil() as u32 + 1;
        Self { seen: (low, high), low: low - MARGIN_CELLS * cell, cell, size: [0, 1, 2].map(count) }
    }

    /// Returns the bounding ball of the grid.
    pub(super) fn ball(&self) -> BoundingBall {
        let half = DVec3::from_array(self.size.map(|size| f64::from(size - 1))) * (self.cell / 2.0);
        BoundingBall { centre: self.low + half, radius: half.length() }
    }

    /// Returns the surface that the pictures show, closed where they show nothing.
    pub(super) fn mesh(&self, sights: &[DepthPicture]) -> Mesh {
        let shape = RuntimeShape::<u32, 3>::new(self.size);
        let distance = |index: u32| {
            let at = shape.delinearize(index);
            let is_end = (0..3).any(|axis| at[axis] == 0 || at[axis] + 1 == self.size[axis]);
            let place = self.low + self.cell * DVec3::from_array(at.map(f64::from));
            // Cells outside of the box are free, so that unseen sides are closed there.
            let outside = (self.seen.0 - place).max(place - self.seen.1).max_element() / self.cell - BOX_SLACK_CELLS;
            if is_end { FRONT_MAX_CELLS as f32 } else { self.distance(place, sights).max(outside) as f32 }
        };
        let mut distances: Vec<f32> = (0..shape.size()).into_par_iter().map(distance).collect();
        self.without_specks(&mut distances);
        let mut nets = SurfaceNetsBuffer::default();
        surface_nets(&distances, &shape, [0; 3], self.size.map(|size| size - 1), &mut nets);
        let origin = self.ball().centre;
        let places: Vec<DVec3> =
            nets.positions.iter().map(|at| self.low + self.cell * DVec3::from_array(at.map(f64::from))).collect();
        let unit = |normal: &[f32; 3]| DVec3::from_array(normal.map(f64::from)).normalize_or(DVec3::Z);
        Mesh {
            name: String::new(),
            origin,
            positions: places.iter().map(|&place| (place - origin).as_vec3().to_array()).collect(),
            normals: nets.normals.iter().map(|normal| unit(normal).as_vec3().to_array()).collect(),
            colours: self.colours(&places, sights),
            triangles: nets.indices.as_chunks::<3>().0.to_vec(),
        }
    }

    /// Returns the signed distance of a position to the surface, cells; negative inside.
    fn distance(&self, place: DVec3, sights: &[DepthPicture]) -> f64 {
        let (mut sum, mut weight) = (-INSIDE_WEIGHT * BEHIND_MAX_CELLS, INSIDE_WEIGHT);
        let mut add = |value: f64, share: f64| (sum, weight) = (sum + share * value, weight + share);
        for (pixel, behind) in sights.iter().filter_map(|sight| sight.pixel_at(place)) {
            let along = -behind / self.cell;
            let cosine = f64::from(pixel.cosine);
            match pixel.is_own {
                _ if along > FRONT_MAX_CELLS => add(FRONT_MAX_CELLS, FREE_WEIGHT),
                // At the surface of another object is outside of this one.
                false if along > -BEHIND_MAX_CELLS => add(FRONT_MAX_CELLS, FREE_WEIGHT),
                false => add(BEHIND_MAX_CELLS, HIDDEN_WEIGHT),
                // Distance across the surface, not along the ray.
                true if along > -BEHIND_MAX_CELLS && pixel.cosine > COSINE_MIN => add(along * cosine, cosine * cosine),
                true if along > -BEHIND_MAX_CELLS => {}
                true => add(-BEHIND_MAX_CELLS, HIDDEN_WEIGHT),
            }
        }
        sum / weight
    }

    /// Fills enclosed cavities, which no picture can see, and removes small separate parts.
    fn without_specks(&self, distances: &mut [f32]) {
        let free = self.regions(distances, |distance| distance >= 0.0);
        // The first region begins at a corner of the grid.
        free.iter().skip(1).flatten().for_each(|&cell| distances[cell] = -BEHIND_MAX_CELLS as f32);
        let parts = self.regions(distances, |distance| distance < 0.0);
        let largest = parts.iter().map(Vec::len).max().unwrap_or(0) as f64;
        let specks = parts.iter().filter(|part| (part.len() as f64) < PART_SIZE_SHARE_MIN * largest);
        specks.flatten().for_each(|&cell| distances[cell] = FRONT_MAX_CELLS as f32);
    }

    /// Returns the cells of each connected region of `wanted` distances, ordered by first cell.
    fn regions(&self, distances: &[f32], wanted: impl Fn(f32) -> bool) -> Vec<Vec<usize>> {
        let [width, height, _] = self.size.map(|size| size as usize);
        let mut open: Vec<bool> = distances.iter().map(|&distance| wanted(distance)).collect();
        let mut regions = Vec::new();
        for first in 0..open.len() {
            if !std::mem::take(&mut open[first]) {
                continue;
            }
            let (mut region, mut next) = (vec![first], 0);
            while let Some(&cell) = region.get(next) {
                next += 1;
                // The border of the grid is free, so steps across a row's end stay within border cells.
                for step in [1, width, width * height] {
                    for near in [cell.checked_sub(step), cell.checked_add(step)].into_iter().flatten() {
                        if open.get_mut(near).is_some_and(std::mem::take) {
                            region.push(near);
                        }
                    }
                }
            }
            regions.push(region);
        }
        regions
    }

    /// Returns the mean colour of each position in the pictures that show it, or else the mean of all colours.
    fn colours(&self, places: &[DVec3], sights: &[DepthPicture]) -> Vec<[f32; 3]> {
        let colour = |&place: &DVec3| {
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for (pixel, behind) in sights.iter().filter_map(|sight| sight.pixel_at(place)) {
                if behind.abs() < BEHIND_MAX_CELLS * self.cell {
                    let share = f64::from(pixel.cosine).powi(2);
                    (sum, weight) = (sum + share * DVec3::from_array(pixel.colour.map(f64::from)), weight + share);
                }
            }
            (weight > 0.0).then(|| sum / weight)
        };
        let seen: Vec<Option<DVec3>> = places.par_iter().map(colour).collect();
        let count = seen.iter().flatten().count().max(1);
        let mean = seen.iter().flatten().sum::<DVec3>() / count as f64;
        seen.into_iter().map(|colour| colour.unwrap_or(mean).as_vec3().to_array()).collect()
    }
}
