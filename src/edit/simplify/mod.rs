//! Reduces the number of Gaussians by merging the pairs that change the renders least.
//!
//! The contribution of a Gaussian is its measured blending weight over all pixels of some views. Pairs are neighbours
//! with the same label, so labels stay as they are. A Gaussian without weight vanishes into its neighbour.

mod blob;

use crate::nearest::tree;
use blob::{Blob, axes, covariance};
use glam::DVec3;
use kiddo::SquaredEuclidean;
use labelgs_scene::{Gaussians, Result};
use rayon::prelude::*;
use std::num::NonZero;

/// Neighbours that a Gaussian may merge with.
const NEIGHBOUR_COUNT: usize = 10;
/// Largest share of the Gaussians merged per round; merged ones find new neighbours in the next.
const ROUND_SHARE_MAX: f64 = 0.1;

/// A model that is being simplified.
#[derive(Clone, Debug)]
pub struct Simplifier<'a> {
    model: &'a Gaussians,
    blobs: Vec<Blob>,
}

impl<'a> Simplifier<'a> {
    /// Starts with a model and the blending weight of each of its Gaussians.
    ///
    /// # Panics
    ///
    /// If there are fewer weights than Gaussians.
    pub fn new(model: &'a Gaussians, weights: &[f32]) -> Self {
        let blob = |row: usize| Blob {
            mean: DVec3::from_array(model.means[row].map(f64::from)),
            covariance: covariance(model.quats[row], model.scales[row]),
            opacity: model.opacity(row),
            weight: weights[row].into(),
            label: model.label(row),
            confidence: model.label_confidence.as_ref().map_or(1.0, |shares| shares[row]),
            harmonics: [&[model.sh0[row]], model.rest(row)].concat(),
            row: Some(row),
        };
        Self { model, blobs: (0..model.len()).map(blob).collect() }
    }

    /// Returns the number of Gaussians.
    pub fn count(&self) -> usize {
        self.blobs.len()
    }

    /// Merges until `count` Gaussians are left, or until no label has two.
    ///
    /// # Errors
    ///
    /// Positions that are not finite.
    pub fn reduce_to(&mut self, count: usize) -> Result<()> {
        while self.blobs.len() > count {
            let most = (self.blobs.len() - count).min((ROUND_SHARE_MAX * self.blobs.len() as f64).ceil() as usize);
            if self.round(most)? == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Merges at most `most` disjoint pairs, the cheapest first. Returns their number.
    fn round(&mut self, most: usize) -> Result<usize> {
        let mut pairs = self.pairs()?;
        pairs.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2))));
        let mut gone = vec![false; self.blobs.len()];
        let mut taken = vec![false; self.blobs.len()];
        let mut merged = 0;
        for (_, into, from) in pairs {
            if merged == most {
                break;
            }
            if taken[into] || taken[from] {
                continue;
            }
            (taken[into], taken[from], gone[from]) = (true, true, true);
            self.blobs[into] = self.blobs[into].merged(&self.blobs[from]);
            merged += 1;
        }
        let mut gone = gone.into_iter();
        self.blobs.retain(|_| !gone.next().unwrap_or_default());
        Ok(merged)
    }

    /// Returns neighbours of the same label, the smaller index first, with the cost of merging them.
    fn pairs(&self) -> Result<Vec<(f64, usize, usize)>> {
        let places: Vec<[f64; 3]> = self.blobs.iter().map(|blob| blob.mean.to_array()).collect();
        // +1: the query returns the Gaussian itself.
        let Some(asked) = NonZero::new((NEIGHBOUR_COUNT + 1).min(places.len())) else { return Ok(Vec::new()) };
        let tree = tree(&places)?;
        let of = |index: usize| {
            let found = tree.query(&places[index]).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
            let others: Vec<usize> = found.iter().map(|item| item.item as usize).collect();
            let near = others
                .into_iter()
                .filter(move |&other| other != index && self.blobs[index].label == self.blobs[other].label);
            let pairs = near.map(move |other| {
                let (first, second) = (index.min(other), index.max(other));
                (self.blobs[first].cost(&self.blobs[second]), first, second)
            });
            pairs.filter(|pair| pair.0.is_finite()).collect::<Vec<_>>()
        };
        let mut pairs: Vec<_> = (0..places.len()).into_par_iter().flat_map_iter(of).collect();
        pairs.par_sort_unstable_by_key(|&(_, first, second)| (first, second));
        pairs.dedup_by_key(|&mut (_, first, second)| (first, second));
        Ok(pairs)
    }

    /// Returns the model. Gaussians that were never merged keep their bits.
    pub fn model(&self) -> Gaussians {
        let mut model = self.model.filtered(|_| false);
        for blob in &self.blobs {
            let (quat, scales, opacity) = match blob.row {
                Some(row) => (self.model.quats[row], self.model.scales[row], self.model.opacities[row]),
                None => {
                    let (turn, sizes) = axes(&blob.covariance);
                    let scales = sizes.map(|size| size.max(1e-12).ln() as f32);
                    let quat = [turn.w, turn.x, turn.y, turn.z].map(|value| value as f32);
                    (quat, scales, (blob.opacity / (1.0 - blob.opacity)).ln() as f32)
                }
            };
            model.means.push(blob.mean.as_vec3().to_array());
            model.quats.push(quat);
            model.scales.push(scales);
            model.opacities.push(opacity);
            model.sh0.push(blob.harmonics[0]);
            model.sh_rest.extend(&blob.harmonics[1..]);
            if let Some(labels) = &mut model.labels {
                labels.push(blob.label);
            }
            if let Some(shares) = &mut model.label_confidence {
                shares.push(blob.confidence);
            }
        }
        model
    }
}

#[cfg(test)]
mod tests {
    use super::Simplifier;
    use labelgs_scene::Gaussians;

    /// Two rows of equal Gaussians, one of each label, interleaved.
    fn rows(count: usize) -> Gaussians {
        let half = |row: usize| row / 2;
        Gaussians {
            means: (0..count).map(|row| [half(row) as f32 * 0.1, (row % 2) as f32 * 0.01, 0.0]).collect(),
            quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
            scales: vec![[-2.0, -2.5, -3.0]; count],
            opacities: vec![0.5; count],
            sh0: vec![[0.2; 3]; count],
            labels: Some((0..count).map(|row| row as u32 % 2).collect()),
            ..Gaussians::default()
        }
    }

    #[test]
    fn labels_never_mix_and_the_last_of_a_label_stays() {
        let model = rows(40);
        let mut simplifier = Simplifier::new(&model, &[1.0; 40]);
        simplifier.reduce_to(10).expect("merged");
        let ten = simplifier.model();
        ten.check().expect("a model");
        assert_eq!((simplifier.count(), ten.len()), (10, 10));
        simplifier.reduce_to(1).expect("merged");
        let mut labels = simplifier.model().labels.expect("labels");
        labels.sort_unstable();
        assert_eq!(labels, [0, 1]);
    }

    #[test]
    fn those_without_weight_go_first_and_the_others_keep_their_bits() {
        let model = rows(40);
        let weights: Vec<f32> = (0..40).map(|row| if row % 4 < 2 { 1.0 } else { 0.0 }).collect();
        let mut simplifier = Simplifier::new(&model, &weights);
        assert_eq!(simplifier.model(), model);
        simplifier.reduce_to(20).expect("merged");
        let left = simplifier.model();
        let kept = model.filtered(|row| row % 4 < 2);
        let mut places = (left.means.clone(), kept.means.clone());
        places.0.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        places.1.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        assert_eq!(places.0, places.1);
    }
}
