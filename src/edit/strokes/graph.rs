//! A graph of the Gaussians near strokes, with the cost of separating each from its neighbours.

use super::flow::Arcs;
use crate::selection::{Nearby, colour, normal};
use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use labelgs_scene::{Error, Gaussians, Result};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::num::NonZeroUsize;

/// Neighbours of a Gaussian, including itself.
const NEIGHBOUR_COUNT: NonZeroUsize = NonZeroUsize::new(11).expect("not zero");
/// Weight of a squared distance, measured in the spacing of both Gaussians.
const DISTANCE_WEIGHT: f64 = 0.2;
/// Weight of a squared colour difference, relative to its mean over all neighbours.
const COLOUR_WEIGHT: f64 = 0.5;
/// Weight of the angle between flat neighbours, measured as one minus its cosine.
const BEND_WEIGHT: f64 = 2.0;
/// Scale of light relative to hue in colour differences: shading changes an object's light more than its hue.
const LIGHT_SCALE: f64 = 0.5;
/// How far existing labels separate two Gaussians if their confidence is 1.
const LABEL_SEPARATION: f64 = 0.9;

/// Gaussians as nodes, each with its neighbours.
pub(super) struct Graph {
    /// Row of each node, ascending.
    pub rows: Vec<usize>,
    /// Node of each row.
    nodes: Vec<Option<u32>>,
    pub arcs: Arcs,
    /// Distance between the nodes of each pair, in the spacing of both.
    lengths: Vec<f32>,
    /// Cost of separating the nodes of each pair, 0 to 1.
    pub weights: Vec<f32>,
    /// Hue and light of each node.
    pub colours: Vec<DVec3>,
    /// Weight of each node: its opacity.
    pub shares: Vec<f32>,
}

impl Graph {
    /// Connects rows, given in ascending order, with their neighbours.
    pub(super) fn new(model: &Gaussians, nearby: &Nearby, rows: Vec<usize>) -> Self {
        let mut nodes = vec![None; model.len()];
        (0..).zip(&rows).for_each(|(node, &row)| nodes[row] = Some(node));
        let near = |&row: &usize| -> Vec<(u32, f64)> {
            let others = nearby.neighbours(row, NEIGHBOUR_COUNT).filter(|&(other, _)| other != row);
            others.filter_map(|(other, distance)| nodes[other].map(|node| (node, distance))).collect()
        };
        let near: Vec<Vec<(u32, f64)>> = rows.par_iter().map(near).collect();
        let mean = |near: &Vec<(u32, f64)>| near.iter().map(|(_, way)| way).sum::<f64>() / near.len().max(1) as f64;
        let spacings: Vec<f64> = near.iter().map(mean).collect();
        let ordered = |(a, near): (u32, &Vec<(u32, f64)>)| -> Vec<([u32; 2], f64)> {
            near.iter().map(|&(b, distance)| ([a.min(b), a.max(b)], distance)).collect()
        };
        let mut pairs: Vec<([u32; 2], f64)> = (0..).zip(&near).flat_map(ordered).collect();
        pairs.par_sort_unstable_by_key(|(pair, _)| *pair);
        pairs.dedup_by_key(|(pair, _)| *pair);
        let colours: Vec<DVec3> = rows.iter().map(|&row| hue_and_light(colour(model, row))).collect();
        let shares = rows.iter().map(|&row| model.opacity(row) as f32).collect();
        let arcs = Arcs::new(rows.len(), pairs.iter().map(|(pair, _)| *pair));
        let spacing = |[a, b]: [u32; 2]| (spacings[a as usize] * spacings[b as usize]).sqrt().max(f64::MIN_POSITIVE);
        let lengths = pairs.iter().map(|&(pair, distance)| (distance / spacing(pair)) as f32).collect();
        let pairs: Vec<[u32; 2]> = pairs.into_iter().map(|(pair, _)| pair).collect();
        let mut graph = Self { rows, nodes, arcs, lengths, weights: Vec::new(), colours, shares };
        graph.weights = graph.weigh(model, &pairs);
        graph
    }

    fn weigh(&self, model: &Gaussians, pairs: &[[u32; 2]]) -> Vec<f32> {
        let normals: Vec<Option<DVec3>> = self.rows.par_iter().map(|&row| normal(model, row)).collect();
        let ends = |pair: [u32; 2]| pair.map(|node| node as usize);
        let square = |[a, b]: [usize; 2]| self.colours[a].distance_squared(self.colours[b]);
        let mean = pairs.iter().map(|&pair| square(ends(pair))).sum::<f64>() / pairs.len().max(1) as f64;
        let weigh = |(&pair, &length): (&[u32; 2], &f32)| {
            let [a, b] = ends(pair);
            let far = f64::from(length).powi(2);
            let unlike = square([a, b]) / mean.max(f64::MIN_POSITIVE);
            let bend = normals[a].zip(normals[b]).map_or(0.0, |(a, b)| 1.0 - a.dot(b).abs());
            let share = f64::from(self.shares[a].min(self.shares[b]));
            let left = separation_left(model, [self.rows[a], self.rows[b]]);
            (share * left * (-DISTANCE_WEIGHT * far - COLOUR_WEIGHT * unlike - BEND_WEIGHT * bend).exp()) as f32
        };
        pairs.par_iter().zip(&self.lengths).map(weigh).collect()
    }

    /// Returns the length of the shortest path from `from` to each node, infinite if there is none. A step is as long
    /// as its pair, times the cost of the node where it ends.
    pub(super) fn path_lengths(&self, from: &[usize], costs: &[f32]) -> Vec<f32> {
        let mut path_lengths = vec![f32::INFINITY; self.rows.len()];
        from.iter().for_each(|&node| path_lengths[node] = 0.0);
        let mut open: BinaryHeap<OpenPath> = from.iter().map(|&node| OpenPath { length: 0.0, node }).collect();
        while let Some(OpenPath { length, node }) = open.pop() {
            if length > path_lengths[node] {
                continue;
            }
            for (_, head, pair) in self.arcs.leaving(node) {
                let further = length + self.lengths[pair] * costs[head];
                if further < path_lengths[head] {
                    path_lengths[head] = further;
                    open.push(OpenPath { length: further, node: head });
                }
            }
        }
        path_lengths
    }

    /// Returns the node of a row, if the graph has it.
    pub(super) fn node(&self, row: usize) -> Option<usize> {
        self.nodes[row].map(|node| node as usize)
    }
}

/// The open end of a path. The shortest path compares greatest.
struct OpenPath {
    length: f32,
    node: usize,
}

impl Ord for OpenPath {
    fn cmp(&self, other: &Self) -> Ordering {
        other.length.total_cmp(&self.length).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for OpenPath {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for OpenPath {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for OpenPath {}

/// Returns the remaining share of the cost of separating two rows: small if they already have different labels.
fn separation_left(model: &Gaussians, rows: [usize; 2]) -> f64 {
    let [a, b] = rows.map(|row| model.label(row));
    let [sure_a, sure_b] = rows.map(|row| label_confidence(model, row));
    if a == b { 1.0 } else { 1.0 - LABEL_SEPARATION * f64::from(sure_a.min(sure_b)) }
}

/// Returns the label confidence of a Gaussian, 0 in a model without labels.
pub(super) fn label_confidence(model: &Gaussians, row: usize) -> f32 {
    let known = if model.labels.is_some() { 1.0 } else { 0.0 };
    model.label_confidence.as_ref().map_or(known, |shares| known * shares[row].clamp(0.0, 1.0))
}

/// Returns the light of a colour and, orthogonal to it, its hue.
fn hue_and_light(colour: [f32; 3]) -> DVec3 {
    let colour = DVec3::from_array(colour.map(f64::from));
    let grey = DVec3::splat(colour.element_sum() / 3.0);
    colour - (1.0 - LIGHT_SCALE) * grey
}

/// Returns the rows in which strokes look for objects: all with a finite position, or in a larger model the `most` that
/// are nearest to the rows in `from`.
pub(super) fn rows_near(model: &Gaussians, from: &[usize], most: usize) -> Result<Vec<usize>> {
    let rows: Vec<usize> = (0..model.len()).filter(|&row| model.is_finite(row)).collect();
    if rows.len() <= most || from.is_empty() {
        return Ok(rows.into_iter().take(most).collect());
    }
    let place = |row: usize| model.means[row].map(f64::from);
    let places: Vec<[f64; 3]> = from.iter().map(|&row| place(row)).collect();
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&places)
        .map_err(|error| Error::Bug(format!("the k-d tree of the strokes failed: {error:?}")))?;
    let distance = |&row: &usize| {
        let near = tree.query(&place(row)).nearest_n::<SquaredEuclidean<f64>>(NonZeroUsize::MIN).execute();
        (near.into_iter().next().map_or(f64::INFINITY, |near| near.distance), row)
    };
    let mut found: Vec<(f64, usize)> = rows.par_iter().map(distance).collect();
    found.select_nth_unstable_by(most, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut rows: Vec<usize> = found[..most].iter().map(|&(_, row)| row).collect();
    rows.sort_unstable();
    Ok(rows)
}
