//! The scores themselves.

use crate::eval::metrics::{byte_value, mean, psnr_of};
use crate::render::Rendered;
use crate::scene::{LabelMap, Photo};
use serde::Serialize;
use std::collections::BTreeMap;

/// Width of the band around the mask that counts as the object's place, px: its pixels are partly the object's.
const BAND: u32 = 2;
/// Width of the ring around that place, px, whose mean colour is the simplest way to close a hole.
const RING: u32 = 4;
/// Opacity below which a pixel is a hole.
const HOLE: f32 = 0.5;
/// Distance of two colours (r, g, b, 0 to 1) from which photo and truth differ enough to tell whose colour is shown.
const DIFFERENT: f64 = 0.1;

/// What one way of removing an object leaves; `None` where there is nothing to compare with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RuleScores {
    /// PSNR against the photos without the object, over its pixels and 2 px around them in all views together, dB.
    pub psnr: Option<f64>,
    /// The same against photos in which its shadow stays: no photo shows the colours outside of that shadow.
    pub psnr_shadowed: Option<f64>,
    /// Of the object's pixels where photos with and without it differ and the model shows anything, the share whose colour
    /// is nearer to the photo with it. Its shadow stays in both, if such photos are given.
    pub leftover: Option<f64>,
    /// Of the blending weight in the object's pixels before the removal, the share of Gaussians that stay. It needs no photo
    /// without the object.
    pub leftover_weight: Option<f64>,
}

/// What closes the pixels that no photo shows: those where neither another object nor a Gaussian that was seen is left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HoleScores {
    /// Share of the object's place.
    pub share: Option<f64>,
    /// PSNR of the filled model there against the photos without the object, dB.
    pub filled: Option<f64>,
    /// The same against photos in which its shadow stays.
    pub filled_shadowed: Option<f64>,
    /// PSNR of the mean colour of a ring around the object in the picture.
    pub mean_colour: Option<f64>,
    /// The same against photos in which its shadow stays.
    pub mean_colour_shadowed: Option<f64>,
}

/// What removals of an object leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ObjectRemoval {
    /// By the labels of the model.
    pub votes: RuleScores,
    /// By labels of the paper's rule for the same Gaussians: each has the label of the last view in which it is the main
    /// Gaussian of a pixel.
    pub main: RuleScores,
    /// By the labels of the model, and filled, without [`leftover`](RuleScores::leftover).
    pub filled: RuleScores,
    /// By the labels of the model, with holes painted in the mean colour of a ring around the object in the picture.
    pub mean_colour: RuleScores,
    /// Of the filled model, where without its new Gaussians there is a hole.
    pub holes: HoleScores,
    /// Share of the object's place that is a hole (opacity below one half) after the removal by the labels of the model.
    pub hole: Option<f64>,
    /// The same after filling.
    pub hole_filled: Option<f64>,
    /// Number of Gaussians that filling adds.
    pub added: u64,
}

/// Scores of removals.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RemovalScores {
    /// Means over the objects.
    pub mean: ObjectRemoval,
    /// Each object over all views, by id.
    pub objects: BTreeMap<u32, ObjectRemoval>,
}

impl RemovalScores {
    /// Computes the means.
    pub fn new(objects: BTreeMap<u32, ObjectRemoval>) -> Self {
        let over = |field: &dyn Fn(&ObjectRemoval) -> Option<f64>| mean(objects.values().filter_map(field));
        let rule = |of: fn(&ObjectRemoval) -> &RuleScores| RuleScores {
            psnr: over(&|row| of(row).psnr),
            psnr_shadowed: over(&|row| of(row).psnr_shadowed),
            leftover: over(&|row| of(row).leftover),
            leftover_weight: over(&|row| of(row).leftover_weight),
        };
        let mean = ObjectRemoval {
            votes: rule(|row| &row.votes),
            main: rule(|row| &row.main),
            filled: rule(|row| &row.filled),
            mean_colour: rule(|row| &row.mean_colour),
            holes: HoleScores {
                share: over(&|row| row.holes.share),
                filled: over(&|row| row.holes.filled),
                filled_shadowed: over(&|row| row.holes.filled_shadowed),
                mean_colour: over(&|row| row.holes.mean_colour),
                mean_colour_shadowed: over(&|row| row.holes.mean_colour_shadowed),
            },
            hole: over(&|row| row.hole),
            hole_filled: over(&|row| row.hole_filled),
            added: objects.values().map(|row| row.added).sum(),
        };
        Self { mean, objects }
    }
}

/// The pixels of an object in a view.
pub(super) struct Region {
    /// Its pixels in the mask.
    inside: Vec<usize>,
    /// These and those within `BAND` of them.
    place: Vec<usize>,
    /// Those within `RING` of the place.
    ring: Vec<usize>,
}

impl Region {
    /// Finds the valid pixels of object `id`; `None` without any.
    pub(super) fn new(mask: &LabelMap, id: u16, photo: &Photo) -> Option<Self> {
        let valid = |index: &usize| photo.rgba[*index][3] > 0;
        let ids = mask.ids.iter().map(|&found| u16::from(found == id)).collect();
        let own = LabelMap { ids, ..mask.clone() };
        let (near, far) = (own.near_contour(BAND), own.near_contour(BAND + RING));
        let pick = |counts: &dyn Fn(usize) -> bool| -> Vec<usize> {
            (0..own.ids.len()).filter(valid).filter(|&index| counts(index)).collect()
        };
        let inside = pick(&|index| own.ids[index] == 1);
        let place = pick(&|index| own.ids[index] == 1 || near[index]);
        let ring = pick(&|index| own.ids[index] == 0 && far[index] && !near[index]);
        (!inside.is_empty()).then_some(Self { inside, place, ring })
    }
}

/// A removal in a view.
#[derive(Clone, Copy)]
pub(super) struct Compare<'a> {
    /// What is left.
    pub rendered: &'a Rendered,
    /// The photo with the object.
    pub photo: &'a Photo,
    /// The photo without it, if there is one.
    pub truth: Option<&'a Photo>,
    /// The same with its shadow.
    pub shadowed: Option<&'a Photo>,
}

impl Compare<'_> {
    fn shown(&self, index: usize) -> [f64; 3] {
        self.rendered.rgb[index].map(|value| f64::from(value.clamp(0.0, 1.0)))
    }

    /// Returns the mean colour of the ring around the object.
    fn around(&self, region: &Region) -> [f64; 3] {
        [0, 1, 2].map(|channel| mean(region.ring.iter().map(|&index| self.shown(index)[channel])).unwrap_or(0.0))
    }

    /// Returns the PSNR over the object's place, dB.
    pub(super) fn psnr(&self, region: &Region) -> Option<f64> {
        let truth = self.truth?;
        mean(region.place.iter().map(|&index| square(self.shown(index), bytes(truth, index)))).map(psnr_of)
    }
}

/// A sum of squared errors.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    sum: f64,
    count: u64,
}

impl Squares {
    fn add(&mut self, shown: [f64; 3], truth: Option<&Photo>, index: usize) {
        if let Some(truth) = truth {
            self.sum += square(shown, bytes(truth, index));
            self.count += 1;
        }
    }

    fn psnr(&self) -> Option<f64> {
        (self.count > 0).then(|| psnr_of(self.sum / self.count as f64))
    }
}

/// Sums over the views of an object.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pixels: u64,
    holes: u64,
    /// As rendered, against both truths, and with holes painted.
    squares: [Squares; 2],
    painted: [Squares; 2],
    different: u64,
    leftover: u64,
}

impl Tally {
    pub(super) fn add(&mut self, region: &Region, compare: &Compare) {
        let is_hole = |index: usize| is_hole(compare.rendered, index);
        self.pixels += region.place.len() as u64;
        self.holes += region.place.iter().filter(|&&index| is_hole(index)).count() as u64;
        let around = compare.around(region);
        for &index in &region.place {
            let shown = compare.shown(index);
            let painted = if is_hole(index) { around } else { shown };
            for (at, truth) in [compare.truth, compare.shadowed].into_iter().enumerate() {
                self.squares[at].add(shown, truth, index);
                self.painted[at].add(painted, truth, index);
            }
        }
        // A shadow that stays is nothing of the object.
        let Some(truth) = compare.shadowed.or(compare.truth) else { return };
        for &index in region.inside.iter().filter(|&&index| !is_hole(index)) {
            let (shown, with, goal) = (compare.shown(index), bytes(compare.photo, index), bytes(truth, index));
            if 3.0 * square(with, goal) > DIFFERENT * DIFFERENT {
                self.different += 1;
                self.leftover += u64::from(square(shown, with) < square(shown, goal));
            }
        }
    }

    pub(super) fn scores(&self, leftover_weight: Option<f64>) -> RuleScores {
        let leftover = (self.different > 0).then(|| self.leftover as f64 / self.different as f64);
        let [psnr, psnr_shadowed] = self.squares.map(|squares| squares.psnr());
        RuleScores { psnr, psnr_shadowed, leftover, leftover_weight }
    }

    /// Returns the PSNRs with holes painted in the mean colour around the object.
    pub(super) fn mean_colour(&self) -> RuleScores {
        let [psnr, psnr_shadowed] = self.painted.map(|squares| squares.psnr());
        RuleScores { psnr, psnr_shadowed, ..RuleScores::default() }
    }

    pub(super) fn hole(&self) -> Option<f64> {
        (self.pixels > 0).then(|| self.holes as f64 / self.pixels as f64)
    }
}

/// Sums over the holes of an object in all views.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Holes {
    pixels: u64,
    holes: u64,
    filled: [Squares; 2],
    mean_colour: [Squares; 2],
}

impl Holes {
    /// Adds a view: `bare` is the filled model without its new Gaussians, `compare` has the filled one.
    pub(super) fn add(&mut self, region: &Region, bare: &Rendered, compare: &Compare) {
        let around = Compare { rendered: bare, ..*compare }.around(region);
        self.pixels += region.place.len() as u64;
        for &index in region.place.iter().filter(|&&index| is_hole(bare, index)) {
            self.holes += 1;
            for (at, truth) in [compare.truth, compare.shadowed].into_iter().enumerate() {
                self.filled[at].add(compare.shown(index), truth, index);
                self.mean_colour[at].add(around, truth, index);
            }
        }
    }

    pub(super) fn scores(&self) -> HoleScores {
        let [filled, filled_shadowed] = self.filled.map(|squares| squares.psnr());
        let [mean_colour, mean_colour_shadowed] = self.mean_colour.map(|squares| squares.psnr());
        let share = (self.pixels > 0).then(|| self.holes as f64 / self.pixels as f64);
        HoleScores { share, filled, filled_shadowed, mean_colour, mean_colour_shadowed }
    }
}

fn is_hole(rendered: &Rendered, index: usize) -> bool {
    rendered.alpha[index] < HOLE
}

fn bytes(photo: &Photo, index: usize) -> [f64; 3] {
    let [r, g, b, _] = photo.rgba[index];
    [r, g, b].map(byte_value)
}

/// Returns the mean squared difference of two colours.
fn square(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|channel| (a[channel] - b[channel]).powi(2)).sum::<f64>() / 3.0
}
