//! Checks each pass of a training step against the reference, on a small scene with labels.

use super::compare::{Band, GradientBounds, Summary, Tolerance, Verdict, close, exact, gradients, pick, sure};
use super::fixture::{Fixture, GRADIENT_PLANES, readable};
use super::order::DepthOrder;
use super::scenes::{Scene, Shape, dot, plain_camera, scene};
use super::{ERROR_FACTOR, judge, model};
use crate::engine::Report;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::label::vote::ballot::{Sweep, Voter, sweep};
use crate::pass::KernelShape;
use crate::reference::blend::{Upstream, blend_backward, blend_forward};
use crate::reference::disagreement::disagreement;
use crate::reference::lift::{self, vote, vote_alone};
use crate::reference::loss::photo_loss;
use crate::reference::splat::Splat;
use crate::reference::step::step;
use crate::reference::tile::{TileGrid, counted_tiles, tiles_within};
use crate::reference::{Model, Rules};
use crate::render::label_map;
use crate::scene::{Gaussians, LabelMap};
use crate::scheduler::plan::Buf;
use crate::shaders::constants::LABEL_MASK;
use crate::train::LabelRule;
use crate::train::strategy::weights::weights;
use std::sync::Arc;

/// Decisions (alpha 1/255, early stop) closer to their threshold than this may go either way.
const DECISION_MARGIN: f64 = 1e-4;
const COLOUR_TOLERANCE: Tolerance = Tolerance { absolute: 6.5e-7 * ERROR_FACTOR, relative: 0.0 };
const CUT_BAND: Band = Band { width: DECISION_MARGIN, flip: 0.01, ratio: 0.005 };

pub(super) const fn bounds(element: f64, whole: f64) -> GradientBounds {
    GradientBounds {
        element: Tolerance { absolute: element * ERROR_FACTOR, relative: 10.0 * element * ERROR_FACTOR },
        outliers: 0.0,
        norm: whole * ERROR_FACTOR,
        angle: whole * ERROR_FACTOR,
        bias: whole * ERROR_FACTOR,
    }
}

/// Returns the colours of pixels.
pub(super) fn colours(pixels: &[[f32; 4]]) -> Vec<[f64; 3]> {
    pixels.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect()
}

/// A finished step, with every buffer still readable.
pub(super) struct FinishedStep {
    fixture: Fixture,
    report: Report,
    splats: Vec<Splat>,
    rules: Rules,
}

impl FinishedStep {
    /// Runs a step with labels and without an update, for comparison with the reference under `rules`.
    pub(super) fn new(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Self> {
        let shape = Shape { gaussians: 150, width: 61, height: 45, opacities: (-4.0, 7.0), ..Shape::default() };
        let mut fixture = Fixture::new(Arc::clone(gpu), scene(62, &shape), true, kernels, readable())?;
        // The paper's rule would change labels from step to step.
        fixture.config.label_rule = LabelRule::Votes;
        let report = fixture.train()?;
        let splats = fixture.splats()?;
        Ok(Self { fixture, report, splats, rules: rules.clone() })
    }

    fn pixels(&mut self) -> Result<Vec<[f32; 4]>> {
        let pixels = self.fixture.pixels();
        self.fixture.get(Buf::IMAGE, pixels)
    }

    /// Checks that visible Gaussians are in depth order, equal depths in row order.
    pub(super) fn order(&mut self) -> Result<Verdict> {
        let (count, visible) = (self.fixture.scene.gaussians.len(), self.splats.len());
        let found = DepthOrder::read(&mut self.fixture)?;
        let by_depth: Vec<(u32, u32)> = found.keys.iter().copied().zip(found.gaussians).collect();
        if visible * 2 <= count || !by_depth.is_sorted_by(|a, b| a < b) {
            return Ok(Err(format!("{visible} of {count} Gaussians are visible, or not in depth order")));
        }
        let depths: Vec<f64> = found.keys.iter().map(|&key| f64::from(f32::from_bits(key))).collect();
        let expected: Vec<f64> = self.splats.iter().map(|splat| splat.depth).collect();
        // Two sums of three products of about 4 units, in different kernels.
        Ok(close(&depths, &expected, Tolerance { absolute: 1e-6 * ERROR_FACTOR, relative: 0.0 }))
    }

    /// Checks centres, conics, opacities and colours of splats.
    pub(super) fn projection(&mut self) -> Result<Verdict> {
        // Centres are about 50 px times the rounding errors of a quotient.
        let tolerance = Tolerance { absolute: 1.4e-5 * ERROR_FACTOR, relative: 0.0 };
        let place = (&self.fixture.scene.camera, &self.fixture.model());
        Ok(judge::projection(&self.rules, place, &self.splats, tolerance))
    }

    /// Checks that each splat is listed in every tile where it counts, and that the lists are sorted.
    pub(super) fn tiles(&mut self) -> Result<Verdict> {
        let pairs = self.report.counters.instance_count as usize;
        let (keys, _) = self.fixture.sorted_pairs(pairs)?;
        let owners = self.fixture.sorted_splats(pairs)?;
        let shape = *self.fixture.engine.shape();
        let grid =
            TileGrid { size: self.fixture.size(), tile: (shape.tile_width as usize, shape.tile_height as usize) };
        let tiles = self.fixture.uniforms().tile_count;
        let mut found = vec![Vec::new(); self.splats.len()];
        for (&key, &owner) in keys.iter().zip(&owners) {
            if let Some(list) = found.get_mut(owner as usize).filter(|_| key < tiles) {
                list.push(key);
            }
        }
        if !keys.is_sorted() {
            return Ok(Err("the tile keys are not sorted".to_owned()));
        }
        for (index, (splat, found)) in self.splats.iter().zip(&found).enumerate() {
            let least = counted_tiles(&self.rules, splat, &grid);
            // The device may list additional tiles within 0.02 in log2 of alpha.
            let most = tiles_within(&self.rules, splat, &grid, 0.02);
            if !least.iter().all(|t| found.contains(t)) || !found.iter().all(|t| most.contains(t)) {
                return Ok(Err(format!(
                    "splat {index} is listed in tiles {found:?}; expected at least {least:?}, at most {most:?}"
                )));
            }
        }
        Ok(Ok(Summary::default()))
    }

    /// Checks colours and transmittance.
    pub(super) fn blend(&mut self) -> Result<Verdict> {
        let image = self.pixels()?;
        let expected =
            blend_forward(&self.rules, &self.splats, self.fixture.size(), self.fixture.scene.target.background);
        Ok(judge::picture(&image, &expected, (COLOUR_TOLERANCE, CUT_BAND)))
    }

    /// Checks L1, SSIM, and their gradient with respect to the picture.
    pub(super) fn loss(&mut self) -> Result<Verdict> {
        let image = colours(&self.pixels()?);
        let v_image = colours(&self.fixture.get(Buf::V_IMAGE, image.len())?);
        let photo = &self.fixture.scene.target.photo;
        let expected = photo_loss(&self.rules, &image, photo);
        let counters = &self.report.counters;
        let sums = [counters.loss_l1, counters.loss_ssim].map(|sum| f64::from(sum) / photo.elements());
        let values =
            close(&sums, &[expected.l1, expected.ssim], Tolerance { absolute: 1e-6 * ERROR_FACTOR, relative: 0.0 });
        // Near its kink, the sign of L1 is undetermined.
        let verdict = sure(expected.margins, 1e-5, 0.0).and_then(|sure| {
            let (actual, wanted) = (pick(&v_image, &sure), pick(&expected.v_image, &sure));
            gradients(actual.as_flattened(), wanted.as_flattened(), bounds(1.1e-6, 4.6e-6))
        });
        Ok(judge::combine([values, verdict]))
    }

    /// Checks the gradients of the splats in a step without object layers, from the device's own picture gradient.
    pub(super) fn blend_backward(&mut self) -> Result<Verdict> {
        let layers = std::mem::take(&mut self.fixture.input.layers);
        self.fixture.input.labels = false;
        self.fixture.train()?;
        let pixels = self.fixture.pixels();
        let v_image = Upstream::from_colours(&colours(&self.fixture.get(Buf::V_IMAGE, pixels)?));
        let splats = self.fixture.splats()?;
        let actual = self.fixture.splat_gradients(&splats)?;
        (self.fixture.input.labels, self.fixture.input.layers) = (true, layers);
        let (size, background) = (self.fixture.size(), self.fixture.scene.target.background);
        let expected = blend_backward(&self.rules, &splats, size, background, &v_image);
        let margins = (&expected.margins[..], 1e-5);
        Ok(judge::splat_gradients(&actual, &expected.values, margins, bounds(4e-7, 4e-7)))
    }

    /// Checks the label disagreement of a step: its value, and its contribution to the opacity gradient.
    pub(super) fn disagreement(&mut self) -> Result<Verdict> {
        // Far above the photo loss, so that the difference of two steps is accurate enough.
        const WEIGHT: f32 = 1e5;
        let layers = std::mem::take(&mut self.fixture.input.layers);
        let label_weight = std::mem::replace(&mut self.fixture.config.label_weight, WEIGHT);
        let with = self.fixture.train()?.counters.loss_label;
        let splats = self.fixture.splats()?;
        let of_labels = self.fixture.splat_gradients(&splats)?;
        self.fixture.input.labels = false;
        self.fixture.train()?;
        let of_photo = self.fixture.splat_gradients(&splats)?;
        (self.fixture.input.labels, self.fixture.input.layers) = (true, layers);
        self.fixture.config.label_weight = label_weight;
        let (model, target) = (self.fixture.model(), &self.fixture.scene.target);
        let steps = f64::from(self.fixture.config.disagreement_every());
        let weight = steps * f64::from(WEIGHT) / target.photo.elements();
        let pixels: Vec<Option<(u32, f64)>> = (target.label_map.iter().zip(&target.photo.valid))
            .map(|(&here, &valid)| (valid && here <= LABEL_MASK).then_some((here, weight)))
            .collect();
        let expected = disagreement(&self.rules, &splats, &model.labels, self.fixture.size(), &pixels);
        // A sum of 2745 pixels in f32.
        let tolerance = Tolerance { absolute: 0.0, relative: 2e-6 * ERROR_FACTOR };
        let value = close(&[f64::from(with)], &[expected.value], tolerance);
        let of_logits = sure(expected.margins, 1e-5, 0.0).and_then(|sure| {
            let by_logit = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
                sure.iter().map(|&row| of(row) * splats[row].opacity).collect()
            };
            let actual = by_logit(&|row| of_labels[row].opacity - of_photo[row].opacity);
            gradients(&actual, &by_logit(&|row| expected.v_opacities[row]), bounds(4e-6, 4e-6))
        });
        Ok(judge::combine([value, of_logits]))
    }

    /// Checks the gradient of photo loss and label losses with respect to every parameter.
    pub(super) fn gradient(&mut self) -> Result<Verdict> {
        self.fixture.train()?;
        let (model, camera, target) =
            (self.fixture.model(), self.fixture.scene.camera.clone(), self.fixture.scene.target.clone());
        let actual = self.fixture.gradient_rows()?;
        let expected = step(&self.rules, &camera, &model, &target);
        Ok(sure(expected.margins, 2e-5, 0.4).and_then(|sure| {
            let (actual, expected) = (pick(&actual, &sure), pick(&expected.rows, &sure));
            judge::rows(&actual, &expected, model.sh_degree, bounds(6.7e-6, 2.3e-6))
        }))
    }

    /// Checks that the same step gives the same bits twice.
    pub(super) fn repeated(&mut self) -> Result<Verdict> {
        let mut bits = || -> Result<Vec<u32>> {
            self.fixture.train()?;
            let (pixels, visible) = (self.fixture.pixels(), self.splats.len());
            let mut all: Vec<u32> = self.fixture.get::<u32>(Buf::IMAGE, pixels * 4)?;
            for plane in [GRADIENT_PLANES[0], GRADIENT_PLANES[1], GRADIENT_PLANES[2], GRADIENT_PLANES[3]] {
                all.extend(self.fixture.get::<u32>(plane, visible * 4)?);
            }
            Ok(all)
        };
        let (first, second) = (bits()?, bits()?);
        Ok(exact(&second, &first))
    }

    /// Checks the sums of blending weights by mask label. With `alone`, occlusion is ignored.
    pub(super) fn votes(&mut self, alone: bool) -> Result<Verdict> {
        let (size, count) = (self.fixture.size(), self.fixture.scene.gaussians.len());
        let (camera, target) = (self.fixture.scene.camera.clone(), &self.fixture.scene.target);
        let ids = target.label_map.iter().map(|&id| id as u16).collect();
        let mask = LabelMap { width: camera.width, height: camera.height, ids };
        let columns_of = mask.ids.clone();
        let mask = mask.into();
        let voter = Voter { camera: &camera, mask: &mask, photo: None, trust: None };
        let how = Sweep { alone, ..Sweep::new(self.fixture.config.near, 0) };
        let ballot = sweep(&mut self.fixture.engine, &[voter], how)?;
        let actual = ballot.weights();
        let column = |id: &u16| ballot.labels.iter().position(|label| label == id);
        let columns: Vec<Option<usize>> = columns_of.iter().map(column).collect();
        let labels = ballot.labels.len();
        let expected = if alone {
            vote_alone(&self.rules, &self.splats, size, count, (&columns, labels))
        } else {
            vote(&self.rules, &self.splats, size, count, &columns, &vec![1.0; labels])
        };
        // Each tile's sum is rounded to 2^-16, and there are at most 48 tiles; pairs near the cut may go either way.
        Ok(close(&actual, &expected, Tolerance { absolute: 48.0 * 0.5 / 65_536.0 + 0.02, relative: 1e-4 }))
    }

    /// Checks the label with the largest sum of blending weights in each pixel, and that sum.
    pub(super) fn label_map(&mut self) -> Result<Verdict> {
        let (size, pixels, labels) = (self.fixture.size(), self.fixture.pixels(), self.fixture.model().labels);
        let (camera, near) = (self.fixture.scene.camera.clone(), self.fixture.config.near);
        let shown = label_map(&mut self.fixture.engine, &camera, near)?;
        let weights = self.fixture.get::<f32>(Buf::LABEL_WEIGHTS, pixels)?;
        let expected = lift::label_map(&self.rules, &self.splats, &labels, size);
        Ok(judge::label_map((&shown.ids, &weights), &expected, (COLOUR_TOLERANCE, DECISION_MARGIN)))
    }

    /// Checks the sums of blending weights over two identical views.
    pub(super) fn weights(&mut self) -> Result<Verdict> {
        let (size, count) = (self.fixture.size(), self.fixture.scene.gaussians.len());
        let (camera, near) = (self.fixture.scene.camera.clone(), self.fixture.config.near);
        let actual = weights(&mut self.fixture.engine, [(&camera, near); 2].into_iter())?;
        let actual: Vec<f64> = actual.into_iter().map(f64::from).collect();
        let expected = vote(&self.rules, &self.splats, size, count, &vec![Some(0); size.0 * size.1], &[2.0]);
        // Sums of up to 3072 pixels; pairs near the cut may go either way.
        Ok(close(&actual, &expected, Tolerance { absolute: 0.02, relative: 1e-4 }))
    }

    /// Checks Adam on all attributes.
    pub(super) fn adam(&mut self) -> Result<Verdict> {
        Ok(model::adam(&mut self.fixture, 3)?(&self.rules))
    }
}

/// Checks a tile with more splats than some drivers allow loop iterations (65,535). The first splats saturate all
/// pixels except those around the last pixel, so that most lanes of a subgroup finish early. The last splats cover the
/// last pixel, where they are visible only if the remaining lanes process the whole list.
pub(super) fn long_list(gpu: &Arc<Gpu>, kernels: KernelShape) -> Result<Verdict> {
    const SPLATS: usize = 70_000;
    let (width, height) = (kernels.tile_width, kernels.tile_height);
    let (camera, last) = (plain_camera(width, height), [f64::from(width) - 0.5, f64::from(height) - 0.5]);
    let centres = (0..height).flat_map(|y| (0..width).map(move |x| [f64::from(x) + 0.5, f64::from(y) + 0.5]));
    // Beyond this distance, px, a dot has no weight at the last pixel.
    let closed: Vec<[f64; 2]> = centres.filter(|at| (at[0] - last[0]).hypot(at[1] - last[1]) > 2.5).collect();
    let row = |i: usize| {
        let (at, opacity) = match closed.get(i % closed.len()) {
            // Four splats of 0.99 end a ray.
            Some(&centre) if i < 4 * closed.len() => (centre, 0.999),
            _ if i + 5 < SPLATS => ([0.5, 0.5], 0.3),
            _ => (last, 0.3),
        };
        dot(&camera, at, 1.0 + i as f64 * 1e-4, 0.3, opacity)
    };
    let grey = Model { rows: (0..SPLATS).map(row).collect(), ..Model::default() };
    let template = scene(1, &Shape { gaussians: 1, width, height, objects: 1, ..Shape::default() });
    let scene = Scene { camera, gaussians: Gaussians { labels: None, ..grey.gaussians() }, ..template };
    let mut fixture = Fixture::new(Arc::clone(gpu), scene, false, kernels, readable())?;
    let report = fixture.render()?;
    let listed = report.counters.longest_list;
    if (listed as usize) < SPLATS - 5 {
        return Ok(Err(format!("the longest list has {listed} splats; expected {SPLATS}")));
    }
    let splats = fixture.splats()?;
    let expected = blend_forward(&Rules::default(), &splats, fixture.size(), fixture.scene.target.background);
    let pixels = fixture.pixels();
    let image = fixture.get::<[f32; 4]>(Buf::IMAGE, pixels)?;
    Ok(judge::picture(&image, &expected, (COLOUR_TOLERANCE, CUT_BAND)))
}
