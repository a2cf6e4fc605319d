//! Computes the removal scores.

use super::RemovalTruth;
use crate::error::Result;
use crate::eval::metrics::{clamped, colour_of, mean, psnr_of, scores, square};
use crate::render::Render;
use crate::scene::{LabelMap, Photo, View};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Width of the band around the mask that belongs to the removal site, px, because its pixels are partly the object's.
const BAND_WIDTH_PX: u32 = 2;
/// Width of the ring around the site, px. Its mean colour is the simplest hole filling, for comparison.
const RING_WIDTH_PX: u32 = 4;
/// Opacity below which a pixel is a hole.
const HOLE_OPACITY_MAX: f32 = 0.5;
/// Smallest colour distance (r, g, b, 0 to 1) between the photos with and without the object for a pixel to be
/// compared.
const COLOUR_DISTANCE_MIN: f64 = 0.1;

scores! {
    /// Scores of one removal method; `None` if there is nothing to compare with.
    RuleScores {
        /// PSNR against the photos without the object, over its pixels and 2 px around them in all views together, dB.
        psnr,
        /// The same against photos that keep its shadow, because training photos never show the area without it.
        psnr_shadowed,
        /// Share of the object's pixels that still look more like the photo with the object. Counts pixels that differ
        /// between both photos and are not holes. Both photos keep the shadow, if given.
        leftover,
        /// Share of the blending weight in the object's pixels that belongs to Gaussians that were not removed. Needs
        /// no photo without the object.
        leftover_weight,
    }
}

scores! {
    /// Scores of filled holes: pixels where nothing remains after the removal.
    HoleScores {
        /// Share of the removal site.
        share,
        /// PSNR of the filled model in the holes against the photos without the object, dB.
        filled,
        /// The same against photos that keep its shadow.
        filled_shadowed,
        /// PSNR of filling with the mean colour of a ring around the object.
        mean_colour,
        /// The same against photos that keep its shadow.
        mean_colour_shadowed,
    }
}

/// Removal scores of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ObjectRemoval {
    /// By the labels of the model.
    pub votes: RuleScores,
    /// By the paper's label rule: each Gaussian takes the label of the last view in which it is a pixel's main
    /// Gaussian.
    pub main: RuleScores,
    /// By the labels of the model, with filling, without [`leftover`](RuleScores::leftover).
    pub filled: RuleScores,
    /// By the labels of the model, with holes painted in the mean colour of a ring around the object.
    pub mean_colour: RuleScores,
    /// Scores of the filled model in the holes.
    pub holes: HoleScores,
    /// Share of the removal site that is a hole (opacity below one half) after removal by the model's labels.
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
    /// Scores of each object over all views, by id.
    pub objects: BTreeMap<u32, ObjectRemoval>,
}

impl RemovalScores {
    /// Computes the means.
    pub fn new(objects: BTreeMap<u32, ObjectRemoval>) -> Self {
        let rows = || objects.values();
        let mean = ObjectRemoval {
            votes: RuleScores::mean(rows().map(|row| &row.votes)),
            main: RuleScores::mean(rows().map(|row| &row.main)),
            filled: RuleScores::mean(rows().map(|row| &row.filled)),
            mean_colour: RuleScores::mean(rows().map(|row| &row.mean_colour)),
            holes: HoleScores::mean(rows().map(|row| &row.holes)),
            hole: mean(rows().filter_map(|row| row.hole)),
            hole_filled: mean(rows().filter_map(|row| row.hole_filled)),
            added: rows().map(|row| row.added).sum(),
        };
        Self { mean, objects }
    }
}

/// The site of a removed object in a view, with the photos to compare it with.
pub(super) struct RemovalSite<'a> {
    pub(super) view: &'a View,
    photo: Arc<Photo>,
    /// The photo without the object, and the same with its shadow, if available.
    pub(super) truths: [Option<Photo>; 2],
    /// The object's pixels in the mask.
    inside: Vec<usize>,
    /// These pixels and all within `BAND_WIDTH_PX` of them.
    around: Vec<usize>,
    /// Pixels within `RING_WIDTH_PX` of that area.
    ring: Vec<usize>,
}

impl<'a> RemovalSite<'a> {
    /// Finds the valid pixels of object `id`; `None` without any.
    pub(super) fn new(id: u16, view: &'a View, truth: &dyn RemovalTruth) -> Result<Option<Self>> {
        // Read the photos only if the mask shows the object.
        let (Some(mask), Some(photo)) = (&view.mask, &view.photo) else { return Ok(None) };
        if !mask.objects().contains(&id) {
            return Ok(None);
        }
        let (mask, photo) = (mask.get()?, photo.get()?);
        let own = LabelMap { ids: mask.ids.iter().map(|&found| u16::from(found == id)).collect(), ..*mask };
        let (near, far) = (own.near_contour(BAND_WIDTH_PX), own.near_contour(BAND_WIDTH_PX + RING_WIDTH_PX));
        let pick = |counts: &dyn Fn(usize) -> bool| -> Vec<usize> {
            (0..own.ids.len()).filter(|&index| photo.rgba[index][3] > 0 && counts(index)).collect()
        };
        let inside = pick(&|index| own.ids[index] == 1);
        let around = pick(&|index| own.ids[index] == 1 || near[index]);
        let ring = pick(&|index| own.ids[index] == 0 && far[index] && !near[index]);
        if inside.is_empty() {
            return Ok(None);
        }
        let truths = [truth.without(id.into(), view)?, truth.shadowed(id.into(), view)?];
        Ok(Some(Self { view, photo, truths, inside, around, ring }))
    }

    /// Returns the mean colour of a picture in the ring around the object.
    fn mean_colour(&self, rendered: &Render) -> [f64; 3] {
        let shown = |channel: usize| self.ring.iter().map(move |&index| clamped(rendered.rgb[index])[channel]);
        [0, 1, 2].map(|channel| mean(shown(channel)).unwrap_or(0.0))
    }

    /// Returns the PSNR of a picture without the object, dB.
    pub(super) fn psnr(&self, rendered: &Render) -> Option<f64> {
        let truth = self.truths[0].as_ref()?;
        let error = |&index: &usize| square(clamped(rendered.rgb[index]), colour_of(truth.rgba[index]));
        mean(self.around.iter().map(error)).map(psnr_of)
    }
}

/// Sums of squared errors against both photos, with pixel counts.
#[derive(Clone, Copy, Debug, Default)]
struct SquaredErrors([(f64, u64); 2]);

impl SquaredErrors {
    fn add(&mut self, shown: [f64; 3], place: &RemovalSite, index: usize) {
        for ((sum, count), truth) in self.0.iter_mut().zip(&place.truths) {
            if let Some(truth) = truth {
                *sum += square(shown, colour_of(truth.rgba[index]));
                *count += 1;
            }
        }
    }

    fn psnr(&self) -> [Option<f64>; 2] {
        self.0.map(|(sum, count)| (count > 0).then(|| psnr_of(sum / count as f64)))
    }
}

/// Returns `part / all`; `None` if `all` is 0.
fn share(part: u64, all: u64) -> Option<f64> {
    (all > 0).then(|| part as f64 / all as f64)
}

/// Sums over the views of an object.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RemovalSums {
    pixels: u64,
    holes: u64,
    /// Errors as rendered, and with holes painted in the surrounding mean colour.
    rendered: SquaredErrors,
    painted: SquaredErrors,
    different: u64,
    leftover: u64,
}

impl RemovalSums {
    /// Adds a picture after the removal.
    pub(super) fn add(&mut self, place: &RemovalSite, rendered: &Render) {
        self.pixels += place.around.len() as u64;
        let colour = place.mean_colour(rendered);
        for &index in &place.around {
            let shown = clamped(rendered.rgb[index]);
            let is_hole = is_hole(rendered, index);
            self.holes += u64::from(is_hole);
            self.rendered.add(shown, place, index);
            self.painted.add(if is_hole { colour } else { shown }, place, index);
        }
        // A remaining shadow does not count as a leftover.
        let [without, shadowed] = &place.truths;
        let Some(truth) = shadowed.as_ref().or(without.as_ref()) else { return };
        for &index in place.inside.iter().filter(|&&index| !is_hole(rendered, index)) {
            let shown = clamped(rendered.rgb[index]);
            let (with, goal) = (colour_of(place.photo.rgba[index]), colour_of(truth.rgba[index]));
            if 3.0 * square(with, goal) > COLOUR_DISTANCE_MIN * COLOUR_DISTANCE_MIN {
                self.different += 1;
                self.leftover += u64::from(square(shown, with) < square(shown, goal));
            }
        }
    }

    pub(super) fn scores(&self, leftover_weight: Option<f64>) -> RuleScores {
        let [psnr, psnr_shadowed] = self.rendered.psnr();
        RuleScores { psnr, psnr_shadowed, leftover: share(self.leftover, self.different), leftover_weight }
    }

    /// Returns the PSNRs with painted holes.
    pub(super) fn mean_colour(&self) -> RuleScores {
        let [psnr, psnr_shadowed] = self.painted.psnr();
        RuleScores { psnr, psnr_shadowed, ..RuleScores::default() }
    }

    pub(super) fn hole(&self) -> Option<f64> {
        share(self.holes, self.pixels)
    }
}

/// Sums over the holes of an object in all views.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HoleSums {
    pixels: u64,
    holes: u64,
    filled: SquaredErrors,
    mean_colour: SquaredErrors,
}

impl HoleSums {
    /// Adds a picture of the filled model, and one without its new Gaussians.
    pub(super) fn add(&mut self, place: &RemovalSite, bare: &Render, filled: &Render) {
        let colour = place.mean_colour(bare);
        self.pixels += place.around.len() as u64;
        for &index in place.around.iter().filter(|&&index| is_hole(bare, index)) {
            self.holes += 1;
            self.filled.add(clamped(filled.rgb[index]), place, index);
            self.mean_colour.add(colour, place, index);
        }
    }

    pub(super) fn scores(&self) -> HoleScores {
        let ([filled, filled_shadowed], [mean_colour, mean_colour_shadowed]) =
            (self.filled.psnr(), self.mean_colour.psnr());
        HoleScores { share: share(self.holes, self.pixels), filled, filled_shadowed, mean_colour, mean_colour_shadowed }
    }
}

fn is_hole(rendered: &Render, index: usize) -> bool {
    rendered.alpha[index] < HOLE_OPACITY_MAX
}
