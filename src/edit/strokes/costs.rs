//! What labels cost Gaussians, and the labels that cost least together.

use super::Mark;
use super::colours::{Nearest, Palette};
use super::flow::smallest_cut;
use super::graph::{Graph, sureness};
use glam::DVec3;
use labelgs_scene::{Gaussians, UNLABELLED};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// What the colour of a Gaussian counts beside a neighbour of the same place and colour.
const BY_COLOUR: f64 = 1.0;
/// What the way to it from the strokes counts, in steps that are longer where colours are not those of the stroke.
const BY_WAY: f64 = 0.5;
/// Power of the cost of a colour in the length of a step, and the least length.
const STEP: (f64, f64) = (2.0, 0.02);
/// Length that is added to all ways, so that the first steps tell little.
const WAY_MIN: f64 = 0.1;
/// What its label counts that it has already.
const BY_LABEL: f64 = 1.0;
/// What it costs an object to have a Gaussian that is hardly there: fog belongs to none.
const FOG: f64 = 0.05;
/// What it costs to contradict a stroke: more than all else together.
const FORBIDDEN: f64 = 1e4;
/// Parts of a cost of 1: costs are whole numbers, so that cuts are the same on every machine.
const SCALE: f64 = 4096.0;
/// Rounds over all labels.
const ROUNDS: usize = 2;

/// What each label costs a node.
pub(super) struct Costs<'a> {
    graph: &'a Graph,
    labels: &'a [u32],
    palettes: Vec<Palette>,
    /// The labels whose colours each node has most.
    by_colour: Vec<Nearest>,
    /// Length of the way from the strokes of each label to each node, and the labels with the shortest ones.
    ways: Vec<Vec<f32>>,
    by_way: Vec<Nearest>,
    marks: Vec<Option<&'a Mark>>,
    /// Labels of the strokes that nodes have already, as places in the list of labels, and how sure they are of them.
    before: Vec<Option<(usize, f32)>>,
}

impl<'a> Costs<'a> {
    /// Compares the nodes of a graph with what strokes say of some of them. `labels` are those of the strokes, with 0,
    /// sorted.
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
            // What does not belong to an object has the colours of the rest.
            let label = if let Mark::On(label) = mark { *label } else { UNLABELLED };
            hit[labels.binary_search(&label).unwrap_or_default()].push(node);
        }
        let palette = |hit: &Vec<usize>| Palette::new(&hit.iter().map(|&node| graph.colours[node]).collect::<Vec<_>>());
        let palettes: Vec<Palette> = hit.par_iter().map(palette).collect();
        let compare = |&colour: &DVec3| Nearest::of(palettes.iter().map(|palette| palette.distance(colour)));
        let by_colour: Vec<Nearest> = graph.colours.par_iter().map(compare).collect();
        let ways = |label: usize| {
            let step = |(&colour, nearest): (&DVec3, &Nearest)| {
                let cost = nearest.cost(label, palettes[label].distance(colour));
                (cost.powf(STEP.0) + STEP.1) as f32
            };
            let steps: Vec<f32> = graph.colours.iter().zip(&by_colour).map(step).collect();
            graph.ways(&hit[label], &steps)
        };
        let ways: Vec<Vec<f32>> = (0..labels.len()).into_par_iter().map(ways).collect();
        let compare = |node: usize| Nearest::of(ways.iter().map(|ways| f64::from(ways[node]) + WAY_MIN));
        let by_way = (0..marks.len()).into_par_iter().map(compare).collect();
        let before = |&row: &usize| {
            let at = labels.binary_search(&model.label(row)).ok().filter(|&at| at > 0);
            at.map(|at| (at, sureness(model, row)))
        };
        let before = graph.rows.iter().map(before).collect();
        Self { graph, labels, palettes, by_colour, ways, by_way, marks, before }
    }

    /// Returns what a label costs each node.
    fn of(&self, label: usize) -> Vec<i64> {
        let graph = self.graph;
        let cost = |node: usize| {
            match self.marks[node] {
                Some(mark) if mark.forbids(self.labels[label]) => return FORBIDDEN,
                Some(Mark::On(_)) => return 0.0,
                _ => {}
            }
            let colour = self.by_colour[node].cost(label, self.palettes[label].distance(graph.colours[node]));
            let way = self.by_way[node].cost(label, f64::from(self.ways[label][node]) + WAY_MIN);
            let other = self.before[node].filter(|(before, _)| *before != label);
            let before = other.map_or(0.0, |(_, sure)| f64::from(sure));
            let share = f64::from(graph.shares[node]);
            let fog = if label == 0 { 0.0 } else { FOG * (1.0 - share) };
            share * (BY_COLOUR * colour + BY_WAY * way + BY_LABEL * before) + fog
        };
        (0..graph.rows.len()).into_par_iter().map(|node| whole(cost(node))).collect()
    }

    /// Returns the label of a stroke on a node, as its place in the list.
    fn first(&self, mark: Option<&Mark>) -> u32 {
        let Some(Mark::On(label)) = mark else { return 0 };
        self.labels.binary_search(label).unwrap_or_default() as u32
    }

    /// Gives each node a label, as its place in the list: at first that of its stroke or none, then in turn each label
    /// to those nodes that cost less with it.
    pub(super) fn expand(&self) -> Vec<u32> {
        let (graph, labels) = (self.graph, self.labels.len());
        let weights: Vec<i32> = graph.weights.iter().map(|&weight| whole(f64::from(weight)) as i32).collect();
        let mut now: Vec<u32> = self.marks.iter().map(|mark| self.first(*mark)).collect();
        let mut costs = vec![0; now.len()];
        for label in 0..labels {
            let own = self.of(label);
            (0..now.len()).filter(|&node| now[node] as usize == label).for_each(|node| costs[node] = own[node]);
        }
        // One label against the rest needs no second look.
        let turns = if labels > 2 { ROUNDS * labels } else { 1 };
        for label in (1..labels).chain([0]).cycle().take(turns) {
            let next = self.of(label);
            let side = expansion(graph, &weights, (&now, &costs), (label as u32, &next));
            for node in (0..now.len()).filter(|&node| side[node]) {
                (now[node], costs[node]) = (label as u32, next[node]);
            }
        }
        self.without_pieces(now)
    }

    /// Takes their label from pieces of objects that no stroke is on and that did not have it before.
    fn without_pieces(&self, mut now: Vec<u32>) -> Vec<u32> {
        let is_known = |node: usize| {
            let had = self.before[node].is_some_and(|(before, _)| before == now[node] as usize);
            had || matches!(self.marks[node], Some(Mark::On(_)))
        };
        let mut is_kept: Vec<bool> = (0..now.len()).map(is_known).collect();
        let mut open: Vec<usize> = (0..now.len()).filter(|&node| is_kept[node]).collect();
        while let Some(node) = open.pop() {
            for (_, head, _) in self.graph.arcs.of(node) {
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

fn whole(cost: f64) -> i64 {
    (cost * SCALE).round() as i64
}

/// Returns the nodes that get a label, of those that have labels and their costs now.
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
            // It keeps the label.
            surplus[node] = whole(FORBIDDEN);
        }
        for (arc, head, pair) in graph.arcs.of(node) {
            if now[node] == now[head] || now[node] == label || now[head] == label {
                room[arc] = weights[pair];
            } else if node < head {
                // Nodes of different labels are parted already. That ends only if both get the label.
                room[arc] = weights[pair];
                surplus[node] += i64::from(weights[pair]);
            }
        }
    }
    smallest_cut(&graph.arcs, room, surplus)
}
