//! Labels carried over to a copy of a model that another program has changed: it may have lost, merged, sorted or rounded
//! Gaussians, and with its column of labels it has lost what they belong to.

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

/// How far a Gaussian of the copy may be from one of the model, as a share of the distance from that one to its eighth
/// neighbour. Two neighbours that were merged are within half of it.
const WITHIN: f64 = 0.5;
/// Places of the model that are compared with one of the copy.
const NEAREST: NonZero<usize> = NonZero::new(8).expect("more than 0");
/// A place up to so many typical displacements further than the nearest may be the one that was displaced.
const DISPLACEMENTS: f64 = 2.0;
/// Least share of the copy that has to be found.
const FOUND_MIN: f64 = 0.5;

/// A copy with the labels of its model.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// The copy: all its values are as they were, but for labels and confidences.
    pub model: Gaussians,
    /// Number of its Gaussians at the very place of one of the model.
    pub same: u64,
    /// Number of those near one.
    pub near: u64,
    /// Number of those without one, which have no label.
    pub none: u64,
}

/// Gives the Gaussians of `copy` the labels and confidences of those of `model` that they come from: the one at the same
/// place, bit for bit, else the nearest one within half the distance of that one's eighth neighbour. Of several at one
/// place, or so near that rounding may have swapped them, it is the one most like it in colour, opacity and size. If `copy`
/// has no origin, positions as stored count. Labels that it has are replaced. Errors if most of `copy` is not found.
pub fn carry(copy: &Gaussians, model: &Gaussians) -> Result<Carried> {
    // Other programs drop the comment with the origin.
    let offset = if copy.origin == DVec3::ZERO { DVec3::ZERO } else { copy.origin - model.origin };
    let sources = Sources::of(model)?;
    let found: Vec<Found> = (0..copy.len()).into_par_iter().map(|row| sources.find(copy, row, offset)).collect();
    let count = |wanted: fn(&Found) -> bool| found.iter().filter(|found| wanted(found)).count() as u64;
    let same = count(|found| matches!(found, Found::Same(_)));
    let near = count(|found| matches!(found, Found::Near(_)));
    let none = copy.len() as u64 - same - near;
    if ((same + near) as f64) < FOUND_MIN * copy.len() as f64 {
        let problem = format!(
            "only {} of {} of the copy are near one of this model; the copy looks moved, turned or scaled, or it is of \
             another model. Save it with the places of the model, or move the model first as the copy was moved",
            same + near,
            counted(copy.len(), "Gaussian"),
        );
        return Err(Error::usage(Setting("like"), problem));
    }
    let displacement = median(found.iter().filter_map(Found::distance)).unwrap_or(0.0);
    let of_row = |(row, found): (usize, &Found)| sources.most_alike(copy, row, found, displacement);
    let from: Vec<Option<usize>> = found.par_iter().enumerate().map(of_row).collect();
    let labels = from.iter().map(|from| from.map_or(UNLABELLED, |from| model.label(from))).collect();
    let confidence = |shares: &Vec<f32>| from.iter().map(|from| from.map_or(0.0, |from| shares[from])).collect();
    let label_confidence = model.label_confidence.as_ref().map(confidence);
    let model = Gaussians { labels: Some(labels), label_confidence, ..copy.clone() };
    Ok(Carried { model, same, near, none })
}

/// What is at a place of the copy.
enum Found {
    /// A place of the model.
    Same(usize),
    /// Places of the model and their distances, the nearest first.
    Near(Vec<(usize, f64)>),
    Nothing,
}

impl Found {
    /// Returns the distance to the nearest place, if it is not the same.
    fn distance(&self) -> Option<f64> {
        match self {
            Self::Near(places) => places.first().map(|place| place.1),
            Self::Same(_) | Self::Nothing => None,
        }
    }
}

/// The Gaussians of a model by their places.
struct Sources<'a> {
    model: &'a Gaussians,
    /// Positions as stored, each once.
    places: HashMap<[u32; 3], usize>,
    /// Rows at each of them.
    rows: Vec<Vec<usize>>,
    /// Largest distance of what comes from a place.
    within: Vec<f64>,
    tree: ImmutableKdTree<f64, 3>,
}

impl<'a> Sources<'a> {
    fn of(model: &'a Gaussians) -> Result<Self> {
        let (mut places, mut rows): (HashMap<_, _>, Vec<Vec<usize>>) = (HashMap::new(), Vec::new());
        for row in (0..model.len()).filter(|&row| model.is_finite(row)) {
            let place = *places.entry(bits(model.means[row])).or_insert(rows.len());
            if place == rows.len() {
                rows.push(Vec::new());
            }
            rows[place].push(row);
        }
        let points: Vec<[f64; 3]> = rows.iter().map(|rows| model.means[rows[0]].map(f64::from)).collect();
        if points.is_empty() {
            return Err(Error::usage(Setting("like"), "the model has no Gaussian with finite values"));
        }
        let tree = tree(&points)?;
        // What is within the thinnest one at a place is at that place, however dense its neighbours are.
        let thinnest = |&row: &usize| f64::from(model.scales[row].into_iter().fold(f32::INFINITY, f32::min)).exp();
        let own = rows.iter().map(|rows| rows.iter().map(thinnest).fold(0.0, f64::max));
        let within = gaps(&points)?.into_iter().zip(own).map(|(gap, own)| (WITHIN * gap).max(own)).collect();
        Ok(Self { model, places, rows, within, tree })
    }

    /// Finds the places that a row of the copy may come from. Its position plus `offset` is one of the model.
    fn find(&self, copy: &Gaussians, row: usize, offset: DVec3) -> Found {
        let mean = copy.means[row];
        if let Some(&place) = self.places.get(&bits(mean)).filter(|_| offset == DVec3::ZERO) {
            return Found::Same(place);
        }
        let at = (DVec3::from_array(mean.map(f64::from)) + offset).to_array();
        if !at.iter().all(|value| value.is_finite()) {
            return Found::Nothing;
        }
        let asked = NEAREST.min(NonZero::new(self.rows.len()).unwrap_or(NEAREST));
        let nearest = self.tree.query(&at).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
        let mut near: Vec<(usize, f64)> = nearest
            .iter()
            .map(|item| (item.item as usize, item.distance.sqrt()))
            .filter(|&(place, distance)| distance <= self.within[place])
            .collect();
        near.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        if near.is_empty() { Found::Nothing } else { Found::Near(near) }
    }

    /// Returns the row of the model that is most like a row of the copy, of those at the places found.
    fn most_alike(&self, copy: &Gaussians, row: usize, found: &Found, displacement: f64) -> Option<usize> {
        let places: Vec<usize> = match found {
            Found::Same(place) => vec![*place],
            Found::Near(near) => {
                let most = near.first()?.1 + DISPLACEMENTS * displacement;
                near.iter().filter(|(_, distance)| *distance <= most).map(|(place, _)| *place).collect()
            }
            Found::Nothing => return None,
        };
        let rows = places.iter().flat_map(|&place| &self.rows[place]);
        let wanted = look(copy, row);
        let unlike = |other: usize| -> f64 {
            let other = look(self.model, other);
            wanted.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        rows.map(|&row| (unlike(row), row)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, row)| row)
    }
}

fn bits(mean: [f32; 3]) -> [u32; 3] {
    // Adding 0 makes -0 and 0 the same.
    mean.map(|value| (value + 0.0).to_bits())
}

/// Returns colour (r, g, b), opacity and sizes as numbers that differ by about 1 between Gaussians that look different.
/// Sizes are sorted, because programs that turn a Gaussian may number its axes anew.
fn look(model: &Gaussians, row: usize) -> [f64; 7] {
    let [r, g, b] = model.sh0[row].map(value_of);
    let mut sizes = model.scales[row].map(f64::from);
    sizes.sort_unstable_by(f64::total_cmp);
    let [least, middle, most] = sizes;
    [r, g, b, model.opacity(row), least, middle, most]
}
