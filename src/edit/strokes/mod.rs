//! Finds objects from strokes on them and on their background, by cutting a graph of Gaussians.
//!
//! A [`StrokesFile`] has strokes over photos. The Gaussians that they hit are [`Seed`]s. A [`GraphCut`] finds the other
//! Gaussians of each object, and [`claim`] turns them into labels of a model.

mod claim;
mod colours;
mod costs;
mod file;
mod flow;
mod graph;

pub use claim::claim;
pub use file::{Stroke, StrokesFile, stroke_title};
pub use flow::{Arcs, smallest_cut};

use crate::selection::Nearby;
use costs::Costs;
use graph::{Graph, rows_near};
use labelgs_scene::{Gaussians, Result, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;

/// Largest number of Gaussians in the graph: those nearest to the strokes on objects. All others belong to no object.
pub const NODES_MAX: usize = 200_000;

/// A Gaussian that a stroke hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed {
    /// Row of the model.
    pub row: usize,
    /// Label of the stroke; 0 for the background.
    pub label: u32,
    /// Whether the Gaussian belongs to the label.
    pub is_on: bool,
}

/// What strokes say about a Gaussian.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Mark {
    /// It has this label.
    On(u32),
    /// It has none of these labels.
    Not(BTreeSet<u32>),
}

impl Mark {
    /// Returns true if the mark contradicts a label.
    fn forbids(&self, label: u32) -> bool {
        match self {
            Self::On(own) => *own != label,
            Self::Not(others) => others.contains(&label),
        }
    }
}

/// Cuts objects out of a model by strokes. Reuses what does not depend on the strokes when more are added.
pub struct GraphCut<M> {
    model: M,
    nearby: Nearby,
    marks: BTreeMap<usize, Mark>,
    graph: Option<Graph>,
}

impl<M: Deref<Target = Gaussians>> GraphCut<M> {
    /// Starts without strokes.
    ///
    /// # Errors
    ///
    /// As [`Nearby::new`].
    pub fn new(model: M) -> Result<Self> {
        Ok(Self { nearby: Nearby::new(&model)?, model, marks: BTreeMap::new(), graph: None })
    }

    /// Adds the Gaussians that strokes hit. Later strokes override earlier ones. Rows outside the model are ignored.
    pub fn add(&mut self, seeds: &[Seed]) {
        for &Seed { row, label, is_on } in seeds.iter().filter(|seed| seed.row < self.model.len()) {
            let mark = match self.marks.remove(&row) {
                _ if is_on || label == UNLABELLED => Mark::On(label),
                Some(Mark::On(own)) if own != label => Mark::On(own),
                Some(Mark::Not(others)) => Mark::Not(others.into_iter().chain([label]).collect()),
                _ => Mark::Not(BTreeSet::from([label])),
            };
            self.marks.insert(row, mark);
        }
        // The graph of a large model covers only the surroundings of the strokes.
        if self.graph.as_ref().is_some_and(|graph| self.marks.keys().any(|&row| graph.node(row).is_none())) {
            self.graph = None;
        }
    }

    /// Returns the labels of the strokes on objects, sorted.
    pub fn labels(&self) -> BTreeSet<u32> {
        let labels =
            self.marks.values().filter_map(|mark| if let Mark::On(label) = mark { Some(*label) } else { None });
        labels.filter(|&label| label != UNLABELLED).collect()
    }

    /// Returns the label of each Gaussian among the strokes' labels, 0 for none of them. In a large model, Gaussians
    /// far from all strokes keep their label if it is one of the strokes' labels.
    ///
    /// Labels expand in turn, each against all others (alpha-expansion: Boykov, Veksler and Zabih, PAMI 2001); with one
    /// label the cut is optimal. A separate piece of an object needs its own stroke, or must already have the label.
    ///
    /// # Errors
    ///
    /// Only a bug.
    pub fn cut(&mut self) -> Result<Vec<u32>> {
        let objects = self.labels();
        let before = (0..self.model.len()).map(|row| self.model.label(row));
        let mut found: Vec<u32> =
            before.map(|label| if objects.contains(&label) { label } else { UNLABELLED }).collect();
        if objects.is_empty() {
            return Ok(found);
        }
        let graph = match self.graph.take() {
            Some(graph) => graph,
            None => Graph::new(&self.model, &self.nearby, self.rows()?),
        };
        let labels: Vec<u32> = std::iter::once(UNLABELLED).chain(objects).collect();
        let nodes = Costs::new(&self.model, &self.marks, &graph, &labels).expand();
        graph.rows.iter().zip(nodes).for_each(|(&row, label)| found[row] = labels[label as usize]);
        self.graph = Some(graph);
        Ok(found)
    }

    /// Returns the rows near the strokes, and those that the strokes hit.
    fn rows(&self) -> Result<Vec<usize>> {
        let is_object = |mark: &Mark| matches!(mark, Mark::On(label) if *label != UNLABELLED);
        let hit: Vec<usize> = self.marks.iter().filter(|(_, mark)| is_object(mark)).map(|(&row, _)| row).collect();
        let near = rows_near(&self.model, &hit, NODES_MAX)?;
        let all: BTreeSet<usize> = near.into_iter().chain(self.marks.keys().copied()).collect();
        Ok(all.into_iter().collect())
    }
}
