//! Objects from strokes, on what belongs to them and on what does not: a cut of a graph of Gaussians.
//!
//! A [`StrokesFile`] has strokes over photos. The Gaussians that they hit are [`Seed`]s, from which a [`Cutting`] finds
//! the others of each object, and [`claim`] makes them labels of a model.

mod claim;
mod colours;
mod costs;
mod file;
mod flow;
mod graph;

pub use claim::claim;
pub use file::{Stroke, StrokesFile, place};
pub use flow::{Arcs, smallest_cut};

use crate::selection::Nearby;
use costs::Costs;
use graph::{Graph, rows_near};
use labelgs_scene::{Gaussians, Result, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;

/// Most Gaussians in which objects are found, those nearest to the strokes on objects. All others belong to none.
pub const NODES_MAX: usize = 200_000;

/// A Gaussian that a stroke hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed {
    /// Row of the model.
    pub row: usize,
    /// Label of the stroke; 0 for what belongs to no object.
    pub label: u32,
    /// It belongs to the label, or it does not.
    pub is_on: bool,
}

/// What strokes say of a Gaussian.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Mark {
    /// It has this label.
    On(u32),
    /// It has none of these.
    Not(BTreeSet<u32>),
}

impl Mark {
    /// Returns true if a label would contradict.
    fn forbids(&self, label: u32) -> bool {
        match self {
            Self::On(own) => *own != label,
            Self::Not(others) => others.contains(&label),
        }
    }
}

/// Objects that are cut from a model by strokes. What does not depend on them is kept for the next strokes.
pub struct Cutting<M> {
    model: M,
    nearby: Nearby,
    marks: BTreeMap<usize, Mark>,
    graph: Option<Graph>,
}

impl<M: Deref<Target = Gaussians>> Cutting<M> {
    /// Starts without strokes.
    ///
    /// # Errors
    ///
    /// As [`Nearby::new`].
    pub fn new(model: M) -> Result<Self> {
        Ok(Self { nearby: Nearby::new(&model)?, model, marks: BTreeMap::new(), graph: None })
    }

    /// Adds what strokes hit. Later strokes correct earlier ones. Rows that the model has not are left out.
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
        // A large model has a graph near the strokes only.
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

    /// Returns the label of each Gaussian among those of the strokes, 0 for none of them. In a large model, what is far
    /// from all strokes keeps that of these labels which it has.
    ///
    /// The labels are found one after the other, each against all others (alpha-expansion: Boykov, Veksler and Zabih,
    /// PAMI 2001); with one label the cut is the best one. A piece of an object needs a stroke of its own, or the label
    /// before.
    ///
    /// # Errors
    ///
    /// A bug only.
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

    /// Returns the rows near the strokes, and those that these hit.
    fn rows(&self) -> Result<Vec<usize>> {
        let is_object = |mark: &Mark| matches!(mark, Mark::On(label) if *label != UNLABELLED);
        let hit: Vec<usize> = self.marks.iter().filter(|(_, mark)| is_object(mark)).map(|(&row, _)| row).collect();
        let near = rows_near(&self.model, &hit, NODES_MAX)?;
        let all: BTreeSet<usize> = near.into_iter().chain(self.marks.keys().copied()).collect();
        Ok(all.into_iter().collect())
    }
}
