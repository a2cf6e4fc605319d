//! Transfers labels to a copy of a model that another program has changed. Such a program may delete, merge, sort or
//! round Gaussians, and it drops the label columns.

use super::clean::gaps;
use crate::nearest::tree;
use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use labelgs_scene::harmonics::value_of;
use labelgs_scene::median::median;
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Gaussians, Result, Setting, UNLABELLED};
use rayon::prelude::*;
use std::collections::HashMap;
use std::num::NonZero;

/// Largest distance of a match, as a share of the distance between the model's Gaussian and its eighth neighbour. Two
/// neighbours that were merged are within half of it.
const MATCH_DISTANCE_MAX: f64 = 0.5;
/// Number of nearest positions in the model that are compared with one in the copy.
const CANDIDATES_MAX: NonZero<usize> = NonZero::new(8).expect("more than 0");
/// Positions are ambiguous if they are at most this many typical displacements farther than the nearest one.
const AMBIGUOUS_DISPLACEMENTS_MAX: f64 = 2.0;
/// The copy is refused if fewer of its Gaussians than this share have a match.
const MATCHED_SHARE_MIN: f64 = 0.5;

/// A copy with the labels of its model.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedLabels {
    /// The copy; only its labels and confidences have changed.
    pub model: Gaussians,
    /// Number of Gaussians of the copy at exactly the position of one in the model.
    pub same: u64,
    /// Number of Gaussians near one in the model.
    pub near: u64,
    /// Number of Gaussians without a match; they have no label.
    pub none: u64,
}

/// Copies labels and confidences from `model` to the matching Gaussians of `copy`.
/// A match has the same position, bit for bit, or is the nearest Gaussian within half the distance to its eighth
/// neighbour. If several share a position, or are so close that rounding may have swapped them, the most similar in
/// colour, opacity and size wins. If `copy` has no origin, stored positions are compared. Existing labels of `copy` are
/// replaced. Errors if most of `copy` has no match.
pub fn carry(copy: &Gaussians, model: &Gaussians) -> Result<CarriedLabels> {
    // Other programs drop the comment with the origin.
    let offset = if copy.origin == DVec3::ZERO { DVec3::ZERO } else { copy.origin - model.origin };
    let sources = Sources::new(model)?;
    let found: Vec<Origin> = (0..copy.len()).into_par_iter().map(|row| sources.find(copy, row, offset)).collect();
    let count = |wanted: fn(&Origin) -> bool| found.iter().filter(|found| wanted(found)).count() as u64;
    let same = count(|found| matches!(found, Origin::Same(_)));
    let near = count(|found| matches!(found, Origin::Near(_)));
    let none = copy.len() as u64 - same - near;
    if ((same + near) as f64) < MATCHED_SHARE_MIN * copy.len() as f64 {
        let problem = format!(
            "only {} of {} of the copy are near one of this model; the copy looks moved, turned or scaled, or it is of \
             another model. Save it with the positions of the model, or move the model first as the copy was moved",
            same + near,
            counted(copy.len(), "Gaussian"),
        );
        return Err(Error::usage(Setting("like"), problem));
    }
    let displacement = median(found.iter().filter_map(Origin::distance)).unwrap_or(0.0);
    let of_row = |(row, found): (usize, &Origin)| sources.most_alike(copy, row, found, displacement);
    let from: Vec<Option<usize>> = found.par_iter().enumerate().map(of_row).collect();
    let labels = from.iter().map(|from| from.map_or(UNLABELLED, |from| model.label(from))).collect();
    let confidence = |shares: &Vec<f32>| from.iter().map(|from| from.map_or(0.0, |from| shares[from])).collect();
    let label_confidence = model.label_confidence.as_ref().map(confidence);
    let model = Gaussians { labels: Some(labels), label_confidence, ..copy.clone() };
    Ok(CarriedLabels { model, same, near, none })
}

/// Where a Gaussian of the copy may come from.
enum Origin {
    /// This position of the model, exactly.
    Same(usize),
    /// Positions of the model with their distances, nearest first.
    Near(Vec<(usize, f64)>),
    Unknown,
}

impl Origin {
    /// Returns the distance to the nearest position unless the match is exact.
    fn distance(&self) -> Option<f64> {
        match self {
            Self::Near(positions) => positions.first().map(|position| position.1),
            Self::Same(_) | Self::Unknown => None,
        }
    }
}

/// The Gaussians of a model by position.
struct Sources<'a> {
    model: &'a Gaussians,
    /// Positions as stored, each once.
    positions: HashMap<[u32; 3], usize>,
    /// Rows at each position.
    rows: Vec<Vec<usize>>,
    /// Largest distance of a match to each position.
    within: Vec<f64>,
    tree: ImmutableKdTree<f64, 3>,
}

impl<'a> Sources<'a> {
    fn new(model: &'a Gaussians) -> Result<Self> {
        let (mut positions, mut rows): (HashMap<_, _>, Vec<Vec<usize>>) = (HashMap::new(), Vec::new());
        for row in (0..model.len()).filter(|&row| model.is_finite(row)) {
            let position = *positions.entry(position_bits(model.means[row])).or_insert(rows.len());
            if position == rows.len() {
                rows.push(Vec::new());
            }
            rows[position].push(row);
        }
        let points: Vec<[f64; 3]> = rows.iter().map(|rows| model.means[rows[0]].map(f64::from)).collect();
        if points.is_empty() {
            return Err(Error::usage(Setting("like"), "the model has no Gaussian with finite values"));
        }
        let tree = tree(&points)?;
        // A Gaussian moved by less than its thinnest axis has not visibly moved, however dense its neighbours are.
        let thinnest = |&row: &usize| f64::from(model.scales[row].into_iter().fold(f32::INFINITY, f32::min)).exp();
        let own = rows.iter().map(|rows| rows.iter().map(thinnest).fold(0.0, f64::max));
        let within =
            gaps(&points)?.into_iter().zip(own).map(|(gap, own)| (MATCH_DISTANCE_MAX * gap).max(own)).collect();
        Ok(Self { model, positions, rows, within, tree })
    }

    /// Finds the positions that a row of the copy may come from. `offset` converts positions of the copy to the
    /// model's.
    fn find(&self, copy: &Gaussians, row: usize, offset: DVec3) -> Origin {
        let mean = copy.means[row];
        if let Some(&position) = self.positions.get(&position_bits(mean)).filter(|_| offset == DVec3::ZERO) {
            return Origin::Same(position);
        }
        let at = (DVec3::from_array(mean.map(f64::from)) + offset).to_array();
        if !at.iter().all(|value| value.is_finite()) {
            return Origin::Unknown;
        }
        let asked = CANDIDATES_MAX.min(NonZero::new(self.rows.len()).unwrap_or(CANDIDATES_MAX));
        let nearest = self.tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        let mut near: Vec<(usize, f64)> = nearest
            .iter()
            .map(|item| (item.item as usize, item.distance.sqrt()))
            .filter(|&(position, distance)| distance <= self.within[position])
            .collect();
        near.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        if near.is_empty() { Origin::Unknown } else { Origin::Near(near) }
    }

    /// Returns the row of the model that is most similar to a row of the copy, among the candidates.
    fn most_alike(&self, copy: &Gaussians, row: usize, found: &Origin, displacement: f64) -> Option<usize> {
        let positions: Vec<usize> = match found {
            Origin::Same(position) => vec![*position],
            Origin::Near(near) => {
                let most = near.first()?.1 + AMBIGUOUS_DISPLACEMENTS_MAX * displacement;
                near.iter().filter(|(_, distance)| *distance <= most).map(|(position, _)| *position).collect()
            }
            Origin::Unknown => return None,
        };
        let rows = positions.iter().flat_map(|&position| &self.rows[position]);
        let wanted = appearance(copy, row);
        let unlike = |other: usize| -> f64 {
            let other = appearance(self.model, other);
            wanted.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        rows.map(|&row| (unlike(row), row)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, row)| row)
    }
}

fn position_bits(mean: [f32; 3]) -> [u32; 3] {
    // Adding 0 turns -0 into 0, so that both compare equal.
    mean.map(|value| (value + 0.0).to_bits())
}

/// Returns colour (r, g, b), opacity and sizes as numbers that differ by about 1 between Gaussians that appearance
/// different. Sizes are sorted, because programs that turn a Gaussian may number its axes anew.
fn appearance(model: &Gaussians, row: usize) -> [f64; 7] {
    let [r, g, b] = model.sh0[row].map(value_of);
    let mut sizes = model.scales[row].map(f64::from);
    sizes.sort_unstable_by(f64::total_cmp);
    let [least, middle, most] = sizes;
    [r, g, b, model.opacity(row), least, middle, most]
}
