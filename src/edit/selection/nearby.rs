//! Selects Gaussians near others, or similar to them.

use crate::nearest::tree;
use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use labelgs_scene::gaussians::axes_of;
use labelgs_scene::harmonics::value_of;
use labelgs_scene::{Gaussians, Result};
use rayon::prelude::*;
use std::num::NonZeroUsize;

/// Neighbours of a Gaussian that a flood visits.
const NEIGHBOUR_COUNT: NonZeroUsize = NonZeroUsize::new(12).expect("not zero");
/// Longest step of a flood, in radii (two standard deviations) of both Gaussians.
const GAP_MAX: f64 = 1.5;
/// A Gaussian has a normal if its thinnest axis is at most this share of its middle one.
const FLAT_MAX: f64 = 0.6;
/// Smallest cosine between the normals of two neighbours in a flood.
const NORMAL_COSINE_MIN: f64 = 0.8;
/// Largest difference from the flood's first colour, in tolerances between neighbours.
const FIRST_COLOUR_TOLERANCES: f32 = 2.0;

/// Spatial index of a model's Gaussians.
pub struct Nearby {
    tree: ImmutableKdTree<f64, 3>,
    places: Vec<[f64; 3]>,
}

impl Nearby {
    /// Builds the index.
    ///
    /// # Errors
    ///
    /// A tree that cannot be built, which is a bug.
    pub fn new(model: &Gaussians) -> Result<Self> {
        // A Gaussian without a finite position is far from all others.
        let place = |mean: &[f32; 3]| {
            let is_finite = mean.iter().all(|value| value.is_finite());
            mean.map(|value| if is_finite { f64::from(value) } else { 1e30 })
        };
        let places: Vec<[f64; 3]> = model.means.iter().map(place).collect();
        let tree = tree(&places)?;
        Ok(Self { tree, places })
    }

    /// Returns the rows nearest to a row, including itself, with their distances.
    pub fn neighbours(&self, row: usize, count: NonZeroUsize) -> impl Iterator<Item = (usize, f64)> {
        let found = self.tree.query(&self.places[row]).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        found.into_iter().map(|near| (near.item as usize, near.distance.sqrt()))
    }

    /// Floods from `first` over neighbours whose colours differ by at most `tolerance` (0 to 1 in each channel) and
    /// whose normals agree, if both are flat. Visits only rows with `is_free`.
    pub fn flood(&self, model: &Gaussians, first: usize, tolerance: f32, is_free: &[bool]) -> Vec<bool> {
        let mut found = vec![false; model.len()];
        let mut open = vec![first];
        found[first] = true;
        let start = colour(model, first);
        while let Some(row) = open.pop() {
            for (next, distance) in self.neighbours(row, NEIGHBOUR_COUNT) {
                if !found[next]
                    && is_free[next]
                    && distance <= GAP_MAX * (radius(model, row) + radius(model, next))
                    && difference(colour(model, row), colour(model, next)) <= tolerance
                    && difference(start, colour(model, next)) <= FIRST_COLOUR_TOLERANCES * tolerance
                    && is_level(model, row, next)
                {
                    found[next] = true;
                    open.push(next);
                }
            }
        }
        found
    }

    /// Adds the neighbours of a selection to it.
    pub fn grown(&self, chosen: &[bool]) -> Vec<bool> {
        let reach = self.spacing(chosen);
        let is_near = |row: usize| chosen[row] || self.has_near(row, reach, |other| chosen[other]);
        (0..chosen.len()).into_par_iter().map(is_near).collect()
    }

    /// Removes the neighbours of unselected Gaussians from a selection.
    pub fn shrunk(&self, chosen: &[bool]) -> Vec<bool> {
        let reach = self.spacing(chosen);
        let is_within = |row: usize| chosen[row] && !self.has_near(row, reach, |other| !chosen[other]);
        (0..chosen.len()).into_par_iter().map(is_within).collect()
    }

    /// Returns the median distance from selected Gaussians to their farthest neighbour.
    fn spacing(&self, chosen: &[bool]) -> f64 {
        let rows: Vec<usize> = (0..chosen.len()).filter(|&row| chosen[row]).collect();
        let step = rows.len().div_ceil(1000).max(1);
        let farthest =
            |&row: &usize| self.neighbours(row, NEIGHBOUR_COUNT).map(|(_, distance)| distance).fold(0.0, f64::max);
        let mut distances: Vec<f64> = rows.iter().step_by(step).map(farthest).collect();
        distances.sort_unstable_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied().unwrap_or_default()
    }

    fn has_near(&self, row: usize, reach: f64, is_asked: impl Fn(usize) -> bool) -> bool {
        let near =
            self.tree.query(&self.places[row]).within::<SquaredEuclidean<f64>>(reach * reach).unsorted().execute();
        near.iter().any(|near| is_asked(near.item as usize))
    }
}

/// Returns the view-independent colour of a Gaussian, 0 to 1.
pub(crate) fn colour(model: &Gaussians, row: usize) -> [f32; 3] {
    model.sh0[row].map(|value| (value_of(value) as f32).clamp(0.0, 1.0))
}

fn difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    [0, 1, 2].map(|channel| (a[channel] - b[channel]).abs()).into_iter().fold(0.0, f32::max)
}

/// Returns two standard deviations along the longest axis.
fn radius(model: &Gaussians, row: usize) -> f64 {
    2.0 * f64::from(model.scales[row].iter().copied().fold(f32::MIN, f32::max)).exp()
}

/// Returns true unless both Gaussians are flat and their normals differ.
fn is_level(model: &Gaussians, a: usize, b: usize) -> bool {
    let normals = [a, b].map(|row| normal(model, row));
    let [Some(a), Some(b)] = normals else { return true };
    a.dot(b).abs() >= NORMAL_COSINE_MIN
}

/// Returns the thinnest axis of a flat Gaussian.
pub(crate) fn normal(model: &Gaussians, row: usize) -> Option<DVec3> {
    let scales = model.scales[row].map(|scale| f64::from(scale).exp());
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| scales[a].total_cmp(&scales[b]));
    (scales[order[0]] <= FLAT_MAX * scales[order[1]]).then(|| axes_of(model.quats[row]).col(order[0]))
}
