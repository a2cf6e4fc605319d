//! Connected parts of a set of Gaussians.
//!
//! Two Gaussians are connected if their ellipsoids of `ELLIPSOID_DEVIATIONS` standard deviations, grown by half of a
//! gap, intersect. The test uses the contact function of Perram and Wertheim (1985).

use crate::nearest::tree;
use glam::{DMat3, DVec3};
use kiddo::SquaredEuclidean;
use labelgs_scene::gaussians::axes_of;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Gaussians, Result};
use std::collections::BTreeMap;

/// Half axes of an ellipsoid in standard deviations: at its surface, an eighth of the opacity remains.
pub const ELLIPSOID_DEVIATIONS: f64 = 2.0;

/// How parts are connected, and which are too small.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grouping {
    /// Largest gap between two connected ellipsoids, world units. At 0 they must touch.
    pub gap: f64,
    /// Share of the Gaussians below which a part is a fragment, 0 to 1. The largest part is never a fragment.
    pub min_share: f64,
}

impl Default for Grouping {
    fn default() -> Self {
        Self { gap: 0.0, min_share: 0.05 }
    }
}

/// The connected parts of a set of rows; the rows of each are sorted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Parts that are large enough, by decreasing size, then by first row.
    pub parts: Vec<Vec<usize>>,
    /// Rows of the fragments.
    pub specks: Vec<usize>,
}

/// Divides `rows` of a model into connected parts.
pub fn components(model: &Gaussians, rows: &[usize], how: Grouping) -> Result<Parts> {
    let _stage = Stage::new("finding connected parts", 0);
    let bodies: Vec<Body> = rows.iter().map(|&row| Body::new(model, row, how.gap)).collect();
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let joined = join(&bodies)?;
    joined.into_iter().zip(rows).for_each(|(group, &row)| groups.entry(group).or_default().push(row));
    let mut parts: Vec<Vec<usize>> = groups.into_values().collect();
    parts.iter_mut().for_each(|part| part.sort_unstable());
    parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
    let least = how.min_share * rows.len() as f64;
    let large = parts.iter().enumerate().take_while(|(index, part)| *index == 0 || part.len() as f64 >= least).count();
    let mut specks: Vec<usize> = parts.split_off(large).concat();
    specks.sort_unstable();
    Ok(Parts { parts, specks })
}

/// Returns the representative of each body's set.
fn join(bodies: &[Body]) -> Result<Vec<usize>> {
    let mut groups = DisjointSets::new(bodies.len());
    let centres: Vec<[f64; 3]> = bodies.iter().map(|body| body.centre.to_array()).collect();
    if !centres.is_empty() {
        let tree = tree(&centres)?;
        for (index, body) in bodies.iter().enumerate() {
            // Test each pair from its larger body, so that a small one has few tests.
            let reach = (2.0 * body.radius).powi(2);
            for found in tree.query(&centres[index]).within::<SquaredEuclidean<f64>>(reach).unsorted().execute() {
                let other = found.item as usize;
                let is_larger = (body.radius, index) > (bodies[other].radius, other);
                if is_larger && groups.root(index) != groups.root(other) && body.meets(&bodies[other]) {
                    groups.join(index, other);
                }
            }
        }
    }
    Ok((0..bodies.len()).map(|index| groups.root(index)).collect())
}

/// Disjoint sets of numbers as trees: each number points at another of its set, and the root at itself.
struct DisjointSets(Vec<usize>);

impl DisjointSets {
    /// Starts with a set for each number below `count`.
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// Returns the root of a number's set and shortens the path to it.
    fn root(&mut self, mut index: usize) -> usize {
        while self.0[index] != index {
            self.0[index] = self.0[self.0[index]];
            index = self.0[index];
        }
        index
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

struct Body {
    centre: DVec3,
    radius: f64,
    /// Rotation times squared half axes times inverse rotation.
    shape: DMat3,
}

impl Body {
    fn new(model: &Gaussians, row: usize, gap: f64) -> Self {
        // Never flat, so that sums of shapes can be inverted.
        let axes = DVec3::from_array(model.scales[row].map(f64::from))
            .map(|scale| ELLIPSOID_DEVIATIONS * scale.exp() + gap / 2.0);
        let axes = axes.clamp(DVec3::splat(axes.max_element() * 1e-6), DVec3::splat(1e100)).max(DVec3::splat(1e-100));
        let turn = axes_of(model.quats[row]);
        Self {
            centre: DVec3::from_array(model.means[row].map(f64::from)),
            radius: axes.max_element(),
            shape: turn * DMat3::from_diagonal(axes * axes) * turn.transpose(),
        }
    }

    /// Returns true if the two ellipsoids intersect, that is if the maximum of s (1 - s) d' ((1 - s) A + s B)^-1 d over
    /// s in 0 to 1 is at most 1. The function is concave, so a ternary search finds its maximum.
    fn meets(&self, other: &Self) -> bool {
        let between = other.centre - self.centre;
        if between.length() > self.radius + other.radius {
            return false;
        }
        let contact = |s: f64| {
            let mixed = self.shape * (1.0 - s) + other.shape * s;
            s * (1.0 - s) * between.dot(mixed.inverse() * between)
        };
        let (mut low, mut high) = (0.0, 1.0);
        // (2/3)^40 is below the precision of f32.
        for _ in 0..40 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            let (at_a, at_b) = (contact(a), contact(b));
            if at_a.max(at_b) > 1.0 {
                return false;
            }
            if at_a < at_b { low = a } else { high = b }
        }
        true
    }
}
