//! Soon after growth, Gaussians that show little go, so that steps cost less, and some of them for parts of others: of
//! those across contours of the masks, which blur two things.

use super::weights::weights;
use super::{Densified, Population};
use crate::error::Result;
use crate::label::vote::ballot::{Ballot, Sweep, sweep};
use crate::label::vote::decide::EVIDENCE;
use crate::train::TrainConfig;

/// Prunes the [share](TrainConfig::prune_share) of the Gaussians with the least blending weight over all training views.
/// Given masks, it splits up to a [share](TrainConfig::contour_share) of the others, and prunes as many more. Statistics
/// start over.
pub(super) fn exchange(population: &mut Population, config: &TrainConfig) -> Result<Densified> {
    let ballot = ballot(population, config)?;
    let weights = match &ballot {
        Some(ballot) if config.mask_border == 0 && population.views().iter().all(|view| view.mask.is_some()) => {
            (0..population.trained_count()).map(|row| ballot.spread(row).0).collect()
        }
        _ => weights_of_all(population)?,
    };
    let least = (config.prune_share * weights.len() as f64) as usize;
    let most = (config.contour_share * (weights.len() - least) as f64) as usize;
    let across = ballot.map_or(Vec::new(), |ballot| across(&ballot, weights.len(), most));
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    order.retain(|row| across.binary_search(row).is_err());
    order.truncate(least + across.len());
    population.replace(&order, &across)
}

/// Returns the votes of all masks; none without any, or if they are not asked for.
fn ballot(population: &mut Population, config: &TrainConfig) -> Result<Option<Ballot>> {
    let voters = population.views().voters();
    if config.contour_share <= 0.0 || voters.is_empty() || population.engine().vote_columns() == 0 {
        return Ok(None);
    }
    sweep(population.engine(), &voters, Sweep::new(config.near, config.mask_border)).map(Some)
}

fn weights_of_all(population: &mut Population) -> Result<Vec<f64>> {
    let views = population.views();
    let cameras = views.iter().enumerate().map(|(index, view)| (views.camera(index), view.near));
    Ok(weights(population.engine(), cameras)?.into_iter().map(f64::from).collect())
}

/// Returns up to `most` of the first `count` Gaussians, sorted: those with the most weight on other labels than their main
/// one, at least [`EVIDENCE`], times its share of all their weight. Without the share, large Gaussians behind an object would come
/// first, of which a little shows beside its contour.
fn across(ballot: &Ballot, count: usize, most: usize) -> Vec<usize> {
    let score = |row: usize| {
        let (all, astray) = ballot.spread(row);
        if astray >= EVIDENCE { astray * astray / all } else { 0.0 }
    };
    let scores: Vec<f64> = (0..count).map(score).collect();
    let mut rows: Vec<usize> = (0..count).filter(|&row| scores[row] > 0.0).collect();
    rows.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
    rows.truncate(most);
    rows.sort_unstable();
    rows
}
