//! Soon after growth, prunes Gaussians that show little, so that steps cost less. Some are replaced by splitting
//! Gaussians across mask contours, which blur two objects.

use super::weights::weights;
use super::{DensifyCounts, Population};
use crate::error::Result;
use crate::label::vote::ballot::{Ballot, Sweep, sweep};
use crate::label::vote::decide::EVIDENCE_MIN_PX;
use crate::train::TrainConfig;

/// Prunes the [share](TrainConfig::prune_share) of the Gaussians with the least blending weight over all training
/// views. Given masks, splits up to a [share](TrainConfig::contour_share) of the others, and prunes as many more.
/// Resets statistics.
pub(super) fn exchange(population: &mut Population, config: &TrainConfig) -> Result<DensifyCounts> {
    let ballot = ballot(population, config)?;
    let weights = match &ballot {
        Some(ballot) if config.mask_border == 0 && population.views.iter().all(|view| view.mask.is_some()) => {
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

/// Returns the votes of all masks; `None` without masks, or if they are not needed.
fn ballot(population: &mut Population, config: &TrainConfig) -> Result<Option<Ballot>> {
    let voters = population.views.voters();
    if config.contour_share <= 0.0 || voters.is_empty() || population.engine().vote_columns() == 0 {
        return Ok(None);
    }
    sweep(population.engine(), &voters, Sweep::new(config.near, config.mask_border)).map(Some)
}

fn weights_of_all(population: &mut Population) -> Result<Vec<f64>> {
    let views = population.views;
    let cameras = views.iter().enumerate().map(|(index, view)| (views.camera(index), view.near));
    Ok(weights(population.engine(), cameras)?.into_iter().map(f64::from).collect())
}

/// Returns up to `most` of the first `count` Gaussians, sorted by row: those with the most weight on labels other than
/// their main label, at least [`EVIDENCE_MIN_PX`], times that weight's share of their total. Without the share, large
/// Gaussians that show slightly beside an object's contour would come first.
fn across(ballot: &Ballot, count: usize, most: usize) -> Vec<usize> {
    let score = |row: usize| {
        let (all, astray) = ballot.spread(row);
        if astray >= EVIDENCE_MIN_PX { astray * astray / all } else { 0.0 }
    };
    let scores: Vec<f64> = (0..count).map(score).collect();
    let mut rows: Vec<usize> = (0..count).filter(|&row| scores[row] > 0.0).collect();
    rows.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
    rows.truncate(most);
    rows.sort_unstable();
    rows
}

#[cfg(test)]
mod tests {
    use super::across;
    use crate::label::vote::ballot::Ballot;
    use crate::shaders::constants::VOTE_ONE;

    /// Votes in px of (row, column) for six Gaussians and two labels.
    fn ballot(votes: &[(u32, u16, u64)]) -> Ballot {
        let votes = votes.iter().map(|&(row, column, weight)| (row, column, weight * VOTE_ONE as u64)).collect();
        Ballot::new(vec![0, 4], 6, votes)
    }

    #[test]
    fn those_with_the_largest_share_and_weight_astray_are_across() {
        let votes = [
            // 30 of 100 px on another label: 9.
            (0, 0, 70),
            (0, 1, 30),
            // All on one label.
            (1, 1, 500),
            // 40 of 2000 px on another label, slightly beside a large object's contour: 0.8.
            (2, 0, 1960),
            (2, 1, 40),
            // Half of 20 px: 5.
            (3, 0, 10),
            (3, 1, 10),
            // 36 of 90 px: 14.4.
            (5, 0, 36),
            (5, 1, 54),
        ];
        let ballot = ballot(&votes);
        assert_eq!(across(&ballot, 6, 3), [0, 3, 5]);
        assert_eq!(across(&ballot, 6, 2), [0, 5]);
        assert_eq!(across(&ballot, 5, 2), [0, 3], "the last one is frozen");
        assert_eq!(across(&ballot, 6, 9), [0, 2, 3, 5], "neither without votes nor with one label");
    }

    #[test]
    fn a_trace_of_votes_is_no_evidence() {
        let mut votes = vec![(0, 0, VOTE_ONE as u64), (0, 1, VOTE_ONE as u64 / 1000)];
        assert!(across(&Ballot::new(vec![0, 4], 1, votes.clone()), 1, 1).is_empty());
        votes[1].2 = VOTE_ONE as u64;
        assert_eq!(across(&Ballot::new(vec![0, 4], 1, votes), 1, 1), [0]);
    }
}
