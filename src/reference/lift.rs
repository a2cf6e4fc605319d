//! Labels from masks: main Gaussian labelling and the Gaussian projection filter. Also the label map of a view.

use super::Rules;
use super::blend::{BlendedImage, centre, trace};
use super::splat::Splat;
use super::tile::exponent;
use std::collections::BTreeMap;

/// Votes of one view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Votes {
    /// Largest key of each Gaussian, `[N]`: weight quantised to 16 bits, then the label; 0 without a vote.
    pub keys: Vec<u32>,
    /// Distance of the nearest decision about each Gaussian, `[N]`: of its weight to the threshold (relative), of its
    /// centre to a pixel border (px), or of a pixel's blending to a different result.
    pub margins: Vec<f64>,
}

/// Masks of a view, and the labels sampled from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Masks<'a> {
    /// Object id per pixel, `[height, width]`.
    pub label_map: &'a [u32],
    /// Sampled labels, without 0.
    pub sampled: &'a [u32],
    /// Gaussian projection filter.
    pub gpf: bool,
}

/// Centre of each of `count` Gaussians in the view; `None` without a splat.
pub fn centres_of(splats: &[Splat], count: usize) -> Vec<Option<[f64; 2]>> {
    let mut centres = vec![None; count];
    splats.iter().for_each(|splat| centres[splat.gaussian] = Some(splat.mean2d));
    centres
}

/// Index of the pixel at a position; `None` outside the image.
pub fn pixel_of(at: [f64; 2], size: (usize, usize)) -> Option<usize> {
    let (x, y) = (at[0].floor(), at[1].floor());
    let inside = x >= 0.0 && y >= 0.0 && x < size.0 as f64 && y < size.1 as f64;
    inside.then(|| y as usize * size.0 + x as usize)
}

/// Distance of a position to the nearest pixel border, px.
pub fn border_distance(at: [f64; 2]) -> f64 {
    at.iter().map(|v| (v - v.round()).abs()).fold(f64::INFINITY, f64::min)
}

/// Vote key: 16 bits of weight (rounded down) above 16 bits of label.
pub fn vote_key(weight: f64, label: u32) -> u32 {
    ((weight * 65_535.0).floor() as u32) << 16 | label
}

/// Votes of one scene image. `centres[gaussian]` is its centre in the view, px; `None` if it is not drawn.
pub fn lift(rules: &Rules, image: &BlendedImage, centres: &[Option<[f64; 2]>], masks: &Masks) -> Votes {
    let mut votes = Votes { keys: vec![0; centres.len()], margins: vec![f64::INFINITY; centres.len()] };
    for (pixel, &label) in image.pixels.iter().zip(masks.label_map) {
        if pixel.main < 0 || label == 0 || !masks.sampled.contains(&label) {
            continue;
        }
        let gaussian = pixel.main as usize;
        let border = centres[gaussian].map_or(f64::INFINITY, border_distance);
        let decided = (pixel.main_weight / rules.lift_threshold - 1.0).abs().min(pixel.margins.image()).min(border);
        votes.margins[gaussian] = votes.margins[gaussian].min(decided);
        let holder = centres[gaussian].and_then(|centre| pixel_of(centre, image.size));
        let allowed = match holder {
            None => false,
            Some(place) => !masks.gpf || masks.label_map[place] & 0xFFFF == label,
        };
        if allowed && pixel.main_weight >= rules.lift_threshold {
            votes.keys[gaussian] = votes.keys[gaussian].max(vote_key(pixel.main_weight, label));
        }
    }
    votes
}

/// Writes the voted labels; Gaussians without a vote keep their label.
pub fn lift_resolve(votes: &Votes, labels: &mut [u32]) {
    for (label, key) in labels.iter_mut().zip(&votes.keys) {
        if *key != 0 {
            *label = key & 0xFFFF;
        }
    }
}

/// Votes of one view, `[N, columns]`, px: sums of blending weights over the pixels of each column, times the column's
/// weight. `columns` gives the column of each pixel, if any.
pub fn vote(
    rules: &Rules,
    splats: &[Splat],
    size: (usize, usize),
    count: usize,
    columns: &[Option<usize>],
    weights: &[f64],
) -> Vec<f64> {
    let mut votes = vec![0.0; count * weights.len()];
    for (index, column) in columns.iter().enumerate() {
        let Some(column) = *column else { continue };
        for contribution in trace(rules, splats.iter().enumerate(), centre(index, size.0)).contributions {
            let gaussian = splats[contribution.splat].gaussian;
            votes[gaussian * weights.len() + column] += contribution.weight() * weights[column];
        }
    }
    votes
}

/// Label of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelLabel {
    /// Label with the largest sum of blending weights, ties to the smaller; 0 if there is none.
    pub label: u32,
    /// Sum of blending weights of the label.
    pub weight: f64,
    /// Number of labels with a weight.
    pub labels: usize,
    /// Distance of the nearest decision: of the sum to the second largest, or of the pixel's blending to a different
    /// result.
    pub margin: f64,
}

/// Label map of one view, `[height, width]`.
pub fn label_map(rules: &Rules, splats: &[Splat], labels: &[u32], size: (usize, usize)) -> Vec<PixelLabel> {
    let pixel = |index: usize| {
        let ray = trace(rules, splats.iter().enumerate(), centre(index, size.0));
        let mut sums = BTreeMap::<u32, f64>::new();
        for contribution in &ray.contributions {
            let sum = sums.entry(labels[splats[contribution.splat].gaussian]).or_default();
            let weight = contribution.weight();
            *sum = if rules.label_sums { *sum + weight } else { sum.max(weight) };
        }
        let (mut label, mut best, mut second) = (0, 0.0, 0.0_f64);
        for (&other, &sum) in &sums {
            if sum > best {
                (label, best, second) = (other, sum, best);
            } else {
                second = second.max(sum);
            }
        }
        let margin =
            ray.margins.cut.min(ray.margins.stop).min(if sums.is_empty() { f64::INFINITY } else { best - second });
        PixelLabel { label, weight: best, labels: sums.len(), margin }
    };
    (0..size.0 * size.1).map(pixel).collect()
}

/// Votes of one view without occlusion, `[N, columns]`, px: sums of alpha over the pixels of each column.
pub fn vote_alone(
    rules: &Rules,
    splats: &[Splat],
    size: (usize, usize),
    count: usize,
    (columns, labels): (&[Option<usize>], usize),
) -> Vec<f64> {
    let mut votes = vec![0.0; count * labels];
    for (index, column) in columns.iter().enumerate() {
        let Some(column) = *column else { continue };
        for splat in splats {
            let at = exponent(splat, centre(index, size.0));
            if at >= rules.exponent_min() {
                votes[splat.gaussian * labels + column] += at.exp2().min(rules.alpha_max);
            }
        }
    }
    votes
}
