//! The costs of labels for Gaussians, and the assignment with the smallest total cost.

use super::Mark;
use super::colours::{NearestTwo, Palette};
use super::flow::smallest_cut;
use super::graph::{Graph, label_confidence};
use glam::DVec3;
use labelgs_scene::{Gaussians, UNLABELLED};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Weight of a Gaussian's colour, relative to a neighbour with the same position and colour.
const COLOUR_WEIGHT: f64 = 1.0;
/// Weight of the path length from the strokes. Steps are longer where colours differ from the stroke's.
const PATH_WEIGHT: f64 = 0.5;
/// Exponent of the colour cost in the length of a step.
const STEP_EXPONENT: f64 = 2.0;
/// Smallest length of a step.
const STEP_MIN: f64 = 0.02;
/// Added to all path lengths, so that the first steps carry little information.
const PATH_LENGTH_OFFSET: f64 = 0.1;
/// Weight of the label that a Gaussian already has.
const LABEL_WEIGHT: f64 = 1.0;
/// Cost of including a nearly transparent Gaussian in an object: floaters belong to none.
const FAINT_COST: f64 = 0.05;
/// Cost of contradicting a stroke, larger than all other costs together.
const FORBIDDEN_COST: f64 = 1e4;
/// Integer units of a cost of 1. Costs are integers, so that cuts are the same on every machine.
const COST_SCALE: f64 = 4096.0;
/// Passes over all labels.
const EXPANSION_PASSES: usize = 2;

/// The cost of each label for each node.
pub(super) struct Costs<'a> {
    graph: &'a Graph,
    labels: &'a [u32],
    palettes: Vec<Palette>,
    /// The labels whose colours are nearest to each node.
    by_colour: Vec<NearestTwo>,
    /// Path length from each label's strokes to each node, and the labels with the shortest paths.
    path_lengths: Vec<Vec<f32>>,
    by_path: Vec<NearestTwo>,
    marks: Vec<Option<&'a Mark>>,
    /// Existing labels of the nodes, as indices in the list of labels, with their confidences.
    before: Vec<Option<(usize, f32)>>,
}

impl<'a> Costs<'a> {
    /// Compares the nodes of a graph with the strokes. `labels` are the sorted labels of the strokes, including 0.
    pub(super) fn new(
        model: &Gaussians,
        marked: &'a BTreeMap<usize, Mark>,
        graph: &'a Graph,
        labels: &'a [u32],
    ) -> Self {
        let mut marks = vec![None; graph.rows.len()];
        let mut hit: Vec<Vec<usize>> = vec![Vec::new(); labels.len()];
        for (&row, mark) in marked {
            let Some(node) = graph.node(row) else { continue };
            marks[node] = Some(mark);
            // The background has the colours of all unmarked Gaussians.
            let label = if let Mark::On(label) = mark { *label } else { UNLABELLED };
            hit[labels.binary_search(&label).unwrap_or_default()].push(node);
        }
        let palette = |hit: &Vec<usize>| Palette::new(&hit.iter().map(|&node| graph.colours[node]).collect::<Vec<_>>());
        let palettes: Vec<Palette> = hit.par_iter().map(palette).collect();
        let compare =
            |&colour: &DVec3| NearestTwo::from_distances(palettes.iter().map(|palette| palette.distance(colour)));
        let by_colour: Vec<NearestTwo> = graph.colours.par_iter().map(compare).collect();
        let path_lengths = |label: usize| {
            let step = |(&colour, nearest): (&DVec3, &NearestTwo)| {
                let cost = nearest.cost(label, palettes[label].distance(colour));
                (cost.powf(STEP_EXPONENT) + STEP_MIN) as f32
            };
            let steps: Vec<f32> = graph.colours.iter().zip(&by_colour).map(step).collect();
            graph.path_lengths(&hit[label], &steps)
        };
        let path_lengths: Vec<Vec<f32>> = (0..labels.len()).into_par_iter().map(path_lengths).collect();
        let compare = |node: usize| {
            NearestTwo::from_distances(
                path_lengths.iter().map(|path_lengths| f64::from(path_lengths[node]) + PATH_LENGTH_OFFSET),
            )
        };
        let by_path = (0..marks.len()).into_par_iter().map(compare).collect();
        let before = |&row: &usize| {
            let at = labels.binary_search(&model.label(row)).ok().filter(|&at| at > 0);
            at.map(|at| (at, label_confidence(model, row)))
        };
        let before = graph.rows.iter().map(before).collect();
        Self { graph, labels, palettes, by_colour, path_lengths, by_path, marks, before }
    }

    /// Returns the cost of a label for each node.
    fn for_label(&self, label: usize) -> Vec<i64> {
        let graph = self.graph;
        let cost = |node: usize| {
            match self.marks[node] {
                Some(mark) if mark.forbids(self.labels[label]) => return FORBIDDEN_COST,
                Some(Mark::On(_)) => return 0.0,
                _ => {}
            }
            let colour = self.by_colour[node].cost(label, self.palettes[label].distance(graph.colours[node]));
            let path = self.by_path[node].cost(label, f64::from(self.path_lengths[label][node]) + PATH_LENGTH_OFFSET);
            let other = self.before[node].filter(|(before, _)| *before != label);
            let before = other.map_or(0.0, |(_, sure)| f64::from(sure));
            let share = f64::from(graph.shares[node]);
            let faint = if label == 0 { 0.0 } else { FAINT_COST * (1.0 - share) };
            share * (COLOUR_WEIGHT * colour + PATH_WEIGHT * path + LABEL_WEIGHT * before) + faint
        };
        (0..graph.rows.len()).into_par_iter().map(|node| quantised(cost(node))).collect()
    }

    /// Returns the label that a stroke gives a node, as an index in the list.
    fn stroke_label(&self, mark: Option<&Mark>) -> u32 {
        let Some(Mark::On(label)) = mark else { return 0 };
        self.labels.binary_search(label).unwrap_or_default() as u32
    }

    /// Assigns each node a label, as an index in the list. Nodes start with the label of their stroke, or 0. Each label
    /// in turn then takes the nodes that it makes cheaper.
    pub(super) fn expand(&self) -> Vec<u32> {
        let (graph, labels) = (self.graph, self.labels.len());
        let weights: Vec<i32> = graph.weights.iter().map(|&weight| quantised(f64::from(weight)) as i32).collect();
        let mut now: Vec<u32> = self.marks.iter().map(|mark| self.stroke_label(*mark)).collect();
        let mut costs = vec![0; now.len()];
        for label in 0..labels {
            let own = self.for_label(label);
            (0..now.len()).filter(|&node| now[node] as usize == label).for_each(|node| costs[node] = own[node]);
        }
        // With one label against the rest, the first cut is optimal.
        let turns = if labels > 2 { EXPANSION_PASSES * labels } else { 1 };
        for label in (1..labels).chain([0]).cycle().take(turns) {
            let next = self.for_label(label);
            let side = expansion(graph, &weights, (&now, &costs), (label as u32, &next));
            for node in (0..now.len()).filter(|&node| side[node]) {
                (now[node], costs[node]) = (label as u32, next[node]);
            }
        }
        self.without_stray_pieces(now)
    }

    /// Removes the label from pieces of objects without a stroke that did not have the label before.
    fn without_stray_pieces(&self, mut now: Vec<u32>) -> Vec<u32> {
        let is_known = |node: usize| {
            let had = self.before[node].is_some_and(|(before, _)| before == now[node] as usize);
            had || matches!(self.marks[node], Some(Mark::On(_)))
        };
        let mut is_kept: Vec<bool> = (0..now.len()).map(is_known).collect();
        let mut open: Vec<usize> = (0..now.len()).filter(|&node| is_kept[node]).collect();
        while let Some(node) = open.pop() {
            for (_, head, _) in self.graph.arcs.leaving(node) {
                if !is_kept[head] && now[head] == now[node] {
                    is_kept[head] = true;
                    open.push(head);
                }
            }
        }
        now.iter_mut().zip(is_kept).filter(|(_, is_kept)| !is_kept).for_each(|(label, _)| *label = 0);
        now
    }
}

fn quantised(cost: f64) -> i64 {
    (cost * COST_SCALE).round() as i64
}

/// Returns the nodes that switch to a label, given the current labels and costs.
fn expansion(
    graph: &Graph,
    weights: &[i32],
    (now, costs): (&[u32], &[i64]),
    (label, next): (u32, &[i64]),
) -> Vec<bool> {
    let mut surplus: Vec<i64> = costs.iter().zip(next).map(|(now, next)| now - next).collect();
    let mut room = vec![0; graph.arcs.len()];
    for node in 0..now.len() {
        if now[node] == label {
            // The node already has the label.
            surplus[node] = quantised(FORBIDDEN_COST);
        }
        for (arc, head, pair) in graph.arcs.leaving(node) {
            if now[node] == now[head] || now[node] == label || now[head] == label {
                room[arc] = weights[pair];
            } else if node < head {
                // Nodes of different labels are already separated. The cost vanishes only if both get the new label.
                room[arc] = weights[pair];
                surplus[node] += i64::from(weights[pair]);
            }
        }
    }
    smallest_cut(&graph.arcs, room, surplus)
}
