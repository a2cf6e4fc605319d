//! Votes for labels: sums over all contributors of all pixels of all masked views, background included (as in
//! FlashSplat).
//!
//! In the paper, the main Gaussian of a pixel takes the pixel's label, and the last view wins. Sums over all views do
//! not depend on view order, and also reach Gaussians that dominate no pixel. The background can outvote a label, and
//! the winner's share is the confidence.

use crate::engine::{Engine, ListKey, VoteInput};
use crate::error::{Error, Result};
use crate::scene::{Camera, LabelMap, Photo, Pixels, UNLABELLED, View};
use crate::shaders::constants::{VOTE_NONE, VOTE_ONE};
use crate::shaders::structs::StepUniforms;
use crate::stage::Stage;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Number of labels that one walk over a tile counts (glsl/lift/vote.comp).
const LABELS_PER_WALK: usize = 4;

/// A view that votes.
#[derive(Clone, Copy, Debug)]
pub struct Voter<'a> {
    /// Camera.
    pub camera: &'a Camera,
    /// Mask of the view.
    pub mask: &'a Pixels<LabelMap>,
    /// Photo of the view; its invalid pixels do not vote.
    pub photo: Option<&'a Pixels<Photo>>,
    /// Weight of this view's votes by label, 0 to 1; 1 for labels without an entry.
    pub trust: Option<&'a BTreeMap<u16, f32>>,
}

impl<'a> Voter<'a> {
    /// Makes a voter from a view and a mask of the same size.
    pub fn for_view(view: &'a View, mask: &'a Pixels<LabelMap>) -> Self {
        Self { camera: &view.camera, mask, photo: view.photo.as_ref(), trust: None }
    }

    /// Makes voters from the views with masks.
    pub fn for_views(views: &[&'a View]) -> Vec<Self> {
        views.iter().filter_map(|view| Some(Self::for_view(view, view.mask.as_ref()?))).collect()
    }
}

/// The options of a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// Near plane, world units.
    pub near: f32,
    /// Width of the band along mask contours without votes, px.
    pub border: u32,
    /// Ignores occlusion: Gaussians vote with their alpha.
    pub alone: bool,
    /// Only labelled pixels vote: in photos of objects alone, everything visible belongs to an object.
    pub labelled_only: bool,
}

impl Sweep {
    /// Makes options for votes by blending weight.
    pub fn new(near: f32, border: u32) -> Self {
        Self { near, border, alone: false, labelled_only: false }
    }
}

/// The votes for one Gaussian: column and sum of blending weights, in the order of columns; a pixel of weight 1 is
/// [`VOTE_ONE`]. Columns without votes are absent, because a Gaussian gets votes for only a few of thousands of
/// objects.
pub(crate) type Row = [(u16, u64)];

/// The votes of all views.
#[derive(Clone, Debug, PartialEq)]
pub struct Ballot {
    /// Label of each column, sorted; the first is 0, the background.
    pub labels: Vec<u16>,
    /// Start of each row among the cells, `[N + 1]`.
    starts: Vec<usize>,
    cells: Vec<(u16, u64)>,
}

impl Ballot {
    /// Makes a ballot from (row, column, votes) in any order, each pair (row, column) at most once, for `count` rows.
    pub fn new(labels: Vec<u16>, count: usize, mut votes: Vec<(u32, u16, u64)>) -> Self {
        votes.par_sort_unstable();
        let mut starts = vec![0; count + 1];
        votes.iter().for_each(|(row, ..)| starts[*row as usize + 1] += 1);
        (0..count).for_each(|row| starts[row + 1] += starts[row]);
        Self { labels, starts, cells: votes.into_iter().map(|(_, column, votes)| (column, votes)).collect() }
    }

    /// Returns the number of Gaussians.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns true without Gaussians.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the votes for Gaussian `row`.
    pub fn row(&self, row: usize) -> &Row {
        &self.cells[self.starts[row]..self.starts[row + 1]]
    }

    /// Returns the weight of Gaussian `row` on a label, px.
    pub fn weight_on(&self, row: usize, label: u32) -> f64 {
        let on = |cell: &&(u16, u64)| u32::from(self.labels[usize::from(cell.0)]) == label;
        self.row(row).iter().find(on).map_or(0.0, |&(_, votes)| weight(votes))
    }

    /// Returns the weight of Gaussian `row` on all labels, and on all but its main label, px.
    pub fn spread(&self, row: usize) -> (f64, f64) {
        let votes = || self.row(row).iter().map(|&(_, votes)| votes);
        let all: u64 = votes().sum();
        (weight(all), weight(all - votes().max().unwrap_or(0)))
    }

    /// Returns the blending weights of all columns, px, `[N, columns]`, in the reference's layout.
    pub fn weights(&self) -> Vec<f64> {
        let mut dense = vec![0.0; self.len() * self.labels.len()];
        for (row, cells) in dense.chunks_mut(self.labels.len()).enumerate() {
            self.row(row).iter().for_each(|&(column, votes)| cells[usize::from(column)] = weight(votes));
        }
        dense
    }
}

/// Returns the number of vote columns for `objects` objects and the background.
pub(crate) fn columns_for(objects: usize) -> u32 {
    objects as u32 + 1
}

/// Counts the votes of all views for the model in the engine. The engine needs memory for votes
/// ([`LabelSize::vote_columns`](crate::engine::LabelSize)), and nothing may be in flight. All labels are counted in one
/// walk over the views if the engine has a column for each, otherwise in as many as needed.
pub fn sweep(engine: &mut Engine, voters: &[Voter], how: Sweep) -> Result<Ballot> {
    let room = engine.vote_columns();
    if room == 0 {
        return Err(Error::Bug("the engine has no memory for votes".to_owned()));
    }
    let objects: BTreeSet<u16> = voters.iter().flat_map(|voter| voter.mask.objects()).collect();
    let labels: Vec<u16> = std::iter::once(UNLABELLED as u16).chain(objects).collect();
    let rows = engine.gaussian_count() as usize;
    let stage = Stage::new("counting votes", voters.len() * labels.len().div_ceil(room));
    engine.begin_votes()?;
    let counted = count(engine, voters, &labels, (how, &stage));
    let ended = engine.end_votes();
    let votes = counted?;
    ended.map(|()| Ballot::new(labels, rows, votes))
}

/// Returns (row, column, votes) of all views, in as many sweeps as needed.
fn count(
    engine: &mut Engine,
    voters: &[Voter],
    labels: &[u16],
    (how, stage): (Sweep, &Stage),
) -> Result<Vec<(u32, u16, u64)>> {
    let room = engine.vote_columns();
    let mut votes = Vec::new();
    for first in (0..labels.len()).step_by(room) {
        let columns = room.min(labels.len() - first);
        let chunk = labels[first..][..columns].to_vec();
        engine.clear_votes()?;
        for voter in voters {
            stage.counted(|| vote(engine, voter, &chunk, how))?;
        }
        let cells = engine.votes(columns)?.into_iter().enumerate().filter(|(_, sum)| *sum > 0);
        votes.extend(cells.map(|(cell, sum)| ((cell / columns) as u32, (first + cell % columns) as u16, sum)));
    }
    Ok(votes)
}

/// Adds the votes of one view for the labels in `chunk`.
fn vote(engine: &mut Engine, voter: &Voter, chunk: &[u16], how: Sweep) -> Result<()> {
    let mask = voter.mask.get()?;
    let mut all_columns = columns_of(&mask, voter.photo.map(Pixels::get).transpose()?.as_deref(), chunk, how.border);
    if how.labelled_only {
        let rest = all_columns.iter_mut().zip(&mask.ids).filter(|(_, id)| **id == 0);
        rest.for_each(|(column, _)| *column = VOTE_NONE);
    }
    let trust = |label: &u16| voter.trust.and_then(|trust| trust.get(label)).copied().unwrap_or(1.0);
    let weights: Vec<f32> = chunk.iter().map(trust).collect();
    for band in engine.bands(voter.camera) {
        let columns = &all_columns[band.pixels(mask.width)];
        let shape = engine.shape();
        let labels = most_labels(columns, mask.width, shape.tile_width, shape.tile_height);
        let rounds = labels.div_ceil(LABELS_PER_WALK) as u32;
        if rounds == 0 {
            continue;
        }
        let base = engine.band_uniforms(voter.camera, band, how.near, [0.0; 3]);
        let uniforms = StepUniforms { vote_columns: chunk.len() as u32, ..base };
        // If votes do not fit, none are counted and the list runs again.
        engine.run(ListKey::Vote(rounds, how.alone), &VoteInput { uniforms, columns, weights: &weights })?;
    }
    Ok(())
}

/// Returns the column of each pixel's label, or [`VOTE_NONE`].
fn columns_of(mask: &LabelMap, photo: Option<&Photo>, chunk: &[u16], border: u32) -> Vec<u32> {
    let mut column = vec![VOTE_NONE; 1 << 16];
    chunk.iter().zip(0..).for_each(|(&id, at)| column[usize::from(id)] = at);
    let mut columns: Vec<u32> = mask.ids.iter().map(|&id| column[usize::from(id)]).collect();
    if let Some(photo) = photo {
        columns.iter_mut().zip(&photo.rgba).filter(|(_, pixel)| pixel[3] < 128).for_each(|(to, _)| *to = VOTE_NONE);
    }
    if border > 0 {
        let near = mask.near_contour(border);
        columns.iter_mut().zip(near).filter(|(_, near)| *near).for_each(|(to, _)| *to = VOTE_NONE);
    }
    columns
}

/// Returns the largest number of distinct columns in a tile.
fn most_labels(columns: &[u32], width: u32, tile_width: u32, tile_height: u32) -> usize {
    let mut most = 0;
    for rows in columns.chunks((width * tile_height).max(1) as usize) {
        let tiles = (0..width).map(|x| x / tile_width).cycle();
        let mut found: Vec<(u32, u32)> = tiles.zip(rows.iter().copied()).filter(|at| at.1 != VOTE_NONE).collect();
        found.dedup();
        found.sort_unstable();
        found.dedup();
        most = found.chunk_by(|a, b| a.0 == b.0).map(<[_]>::len).max().unwrap_or(0).max(most);
    }
    most
}

/// Converts votes to blending weight, px.
pub(crate) fn weight(votes: u64) -> f64 {
    votes as f64 / f64::from(VOTE_ONE)
}
