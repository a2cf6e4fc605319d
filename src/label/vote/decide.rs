//! Decides label and confidence of every Gaussian from the votes.

use super::ballot::{Ballot, Sweep, Voter, sweep, weight};
use crate::edit::nearest::tree;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::render::label_map;
use crate::scene::{Camera, Gaussians, LabelMap, UNLABELLED};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::num::NonZero;

/// Gaussians with less weight over all views, px, also get their neighbours' votes. With less than one pixel in all
/// views, a Gaussian is inside or behind an object, and its own votes mean little.
pub(crate) const EVIDENCE_MIN_PX: f64 = 1.0;
/// Number of neighbours that vote.
const VOTING_NEIGHBOURS: usize = 8;
/// Smallest longest side at which masks are compared with the model's labels, px. Agreement is a ratio over many
/// pixels, and needs fewer pixels than votes.
const JUDGED_SIDE_MIN_PX: f64 = 160.0;

/// The labels of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// Labels, `[N]`; 0 is the background.
    pub labels: Vec<u32>,
    /// Share of the winning label in all votes, `[N]`, 0 to 1; 0 without votes.
    pub confidence: Vec<f32>,
}

impl Decision {
    /// Sets labels with a confidence below `least` to 0.
    pub fn drop_unsure(&mut self, least: f32) {
        for (label, _) in self.labels.iter_mut().zip(&self.confidence).filter(|(_, share)| **share < least) {
            *label = UNLABELLED;
        }
    }
}

/// Decides for the label with the most votes; ties go to the smaller label. For a Gaussian with little weight, its
/// nearest neighbours with enough weight vote too. The inside of an object thus gets its label, and is removed with it.
pub fn decide(ballot: &Ballot, means: &[[f32; 3]]) -> Result<Decision> {
    if ballot.len() != means.len() {
        return Err(Error::Bug(format!("{} rows of votes for {} Gaussians", ballot.len(), means.len())));
    }
    let own = |row: usize| ballot.row(row).iter().map(|&(column, votes)| (column, weight(votes)));
    let (totals, winners): (Vec<f64>, Vec<u16>) = (0..means.len())
        .into_par_iter()
        .map(|row| (own(row).map(|(_, share)| share).sum::<f64>(), winner(own(row))))
        .unzip();
    let tree = tree_of(means, &totals)?;
    let decide_row = |row: usize| {
        let mut votes: BTreeMap<u16, f64> = own(row).collect();
        if let Some((tree, rows)) = tree.as_ref().filter(|_| totals[row] < EVIDENCE_MIN_PX)
            && let Some(asked) = NonZero::new(VOTING_NEIGHBOURS.min(rows.len()))
        {
            let at = means[row].map(f64::from);
            let near = tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
            for item in &near {
                let winner = winners[rows[item.item as usize]];
                *votes.entry(winner).or_default() += (EVIDENCE_MIN_PX - totals[row]) / asked.get() as f64;
            }
        }
        let column = winner(votes.iter().map(|(&column, &share)| (column, share)));
        let total: f64 = votes.values().sum();
        let confidence = if total > 0.0 { votes.get(&column).copied().unwrap_or(0.0) / total } else { 0.0 };
        (u32::from(ballot.labels[usize::from(column)]), confidence as f32)
    };
    let (labels, confidence) = (0..means.len()).into_par_iter().map(decide_row).unzip();
    Ok(Decision { labels, confidence })
}

/// Lowers the confidence of Gaussians that stick out of their object to the share of their alpha inside the object's
/// masks, ignoring occlusion. Such Gaussians are hidden behind other things in the scene, and would show when the
/// object is extracted.
pub(crate) fn lower_outside(engine: &mut Engine, voters: &[Voter], how: Sweep, decision: &mut Decision) -> Result<()> {
    let ballot = sweep(engine, voters, Sweep { alone: true, ..how })?;
    let rows = decision.labels.iter().zip(&mut decision.confidence).enumerate();
    for (row, (&label, confidence)) in rows.filter(|(_, (label, _))| **label != UNLABELLED) {
        let (inside, outside) = (ballot.weight_on(row, label), ballot.weight_on(row, UNLABELLED));
        if inside + outside > 0.0 {
            *confidence = confidence.min((inside / (inside + outside)) as f32);
        }
    }
    Ok(())
}

/// Returns the column with the largest share; ties go to the first, and it is 0 without columns.
fn winner(shares: impl Iterator<Item = (u16, f64)>) -> u16 {
    shares.fold((0, 0.0), |best, at| if at.1 > best.1 { at } else { best }).0
}

/// Returns a k-d tree of the Gaussians with enough weight, and their rows.
fn tree_of(means: &[[f32; 3]], totals: &[f64]) -> Result<Option<(ImmutableKdTree<f64, 3>, Vec<usize>)>> {
    let sure = |&row: &usize| totals[row] >= EVIDENCE_MIN_PX && means[row].iter().all(|value| value.is_finite());
    let rows: Vec<usize> = (0..means.len()).filter(sure).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let places: Vec<[f64; 3]> = rows.iter().map(|&row| means[row].map(f64::from)).collect();
    let tree = tree(&places)?;
    Ok(Some((tree, rows)))
}

/// Returns camera and mask at the size for judging masks: half of full size, but not below
/// [`JUDGED_SIDE_MIN_PX`].
fn judged(voter: &Voter) -> Result<(Camera, LabelMap)> {
    let longest = voter.camera.width.max(voter.camera.height);
    let camera = voter.camera.shrunk((JUDGED_SIDE_MIN_PX / f64::from(longest)).clamp(0.5, 1.0));
    let mask = voter.mask.get()?.resized(camera.width, camera.height);
    Ok((camera, mask))
}

/// For each label, the number of mask pixels where the model shows the same label, and of all its mask pixels.
pub type Agreement = BTreeMap<u16, (u64, u64)>;

/// Compares the mask of a view with the rendered labels.
pub fn agreement(mask: &LabelMap, rendered: &LabelMap) -> Agreement {
    let mut counts = Agreement::new();
    for (&id, &shown) in mask.ids.iter().zip(&rendered.ids) {
        let (same, all) = counts.entry(id).or_default();
        *same += u64::from(id == shown);
        *all += 1;
    }
    counts
}

/// Returns the trust in the mask of each view by label, at most 1: the squared ratio of the view's agreement with the
/// model to the agreement of all views together. Masks with swapped or merged ids thus count little in the next round.
/// The ratio is relative, because low agreement in every view indicates a hard label, not a bad mask: otherwise thin
/// objects would lose to their background, and a lost label could never return.
pub fn trust(views: &[Agreement]) -> Vec<BTreeMap<u16, f32>> {
    let mut together = Agreement::new();
    for (&id, &(same, all)) in views.iter().flatten() {
        let (sum, of) = together.entry(id).or_default();
        *sum += same;
        *of += all;
    }
    let share = |(same, all): (u64, u64)| same as f64 / all as f64;
    let of_view = |view: &Agreement| {
        let trust = |(&id, &counts): (&u16, &(u64, u64))| match together[&id] {
            (0, _) => (id, 1.0),
            usual => (id, (share(counts) / share(usual)).min(1.0).powi(2) as f32),
        };
        view.iter().map(trust).collect()
    };
    views.iter().map(of_view).collect()
}

pub(crate) fn apply(model: &mut Gaussians, decision: Decision) {
    model.labels = Some(decision.labels);
    model.label_confidence = Some(decision.confidence);
}

/// Counts the votes of `voters` for the model in the engine and decides. If `is_judged`, masks that disagree with the
/// engine's labels count less ([`trust`]). Nothing may be in flight.
pub(crate) fn count(
    engine: &mut Engine,
    voters: &[Voter],
    is_judged: bool,
    means: &[[f32; 3]],
    how: Sweep,
) -> Result<Decision> {
    let mut agreements = Vec::new();
    for voter in voters.iter().filter(|_| is_judged) {
        let (camera, mask) = judged(voter)?;
        agreements.push(agreement(&mask, &label_map(engine, &camera, how.near)?));
    }
    let trusts = trust(&agreements);
    let voters: Vec<Voter> =
        voters.iter().enumerate().map(|(index, voter)| Voter { trust: trusts.get(index), ..*voter }).collect();
    decide(&sweep(engine, &voters, how)?, means)
}
