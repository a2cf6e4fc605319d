//! The input of one step: uniforms, photo, masks.

use super::backdrop;
use super::known_depths::{self, KnownDepths};
use crate::engine::{Engine, LayerInput, TrainInput};
use crate::pass::Supervision;
use crate::scene::{Camera, LabelMap, Occluders, Photo, Pixels};
use crate::scheduler::DataKey;
use crate::shaders::constants::{ADAM_BETA1, ADAM_BETA2, ALPHA_SLACK, FINEST, LABEL_BORDER};
use crate::shaders::structs::StepUniforms;
use crate::train::{LabelRule, TrainConfig};
use std::collections::BTreeMap;

/// Share of D-SSIM in the photometric loss; the rest is L1 (3DGS).
pub(in crate::train) const LAMBDA_DSSIM: f32 = 0.2;
/// Largest weight of a small object relative to the mean.
const LAYER_WEIGHT_MAX: f64 = 10.0;

/// A training view.
#[derive(Debug)]
pub struct TrainView {
    /// Name, for messages.
    pub name: String,
    /// Camera.
    pub camera: Camera,
    /// Near plane, world units.
    pub near: f32,
    /// Photo.
    pub photo: Pixels<Photo>,
    /// Mask, if the view has one.
    pub mask: Option<Pixels<LabelMap>>,
    /// Ids of the objects in the mask, sorted.
    pub objects: Vec<u16>,
    /// The mask in the layout of the device, one word per pixel, row-major; empty without a mask.
    pub view_labels: Pixels<Vec<u32>>,
    /// Known depths of the photo.
    pub depths: KnownDepths,
    /// Occluders of each object in this view.
    pub occluders: Occluders,
}

/// A view at the step's size.
#[derive(Clone, Copy, Debug)]
pub struct StepView<'a> {
    /// Key of photo and mask at this size; `None` if they will not be used again.
    pub key: Option<DataKey>,
    /// Camera.
    pub camera: &'a Camera,
    /// Camera of the whole photo, if this is a part of it.
    pub whole: Option<&'a Camera>,
    /// Near plane, world units.
    pub near: f32,
    /// Smallest standard deviation of Gaussians at depth 1, world units.
    pub finest: f32,
    /// Photo.
    pub photo: &'a Photo,
    /// Number of valid photo pixels.
    pub valid_pixels: u64,
    /// The mask in device layout; empty without a mask.
    pub view_labels: &'a [u32],
    /// 1 / known depth of each pixel, 0 for unknown; empty in a step without.
    pub depths: &'a [f32],
    /// Light and area of each object, by id.
    pub shown: &'a BTreeMap<u16, ObjectLight>,
    /// Occluders of each object.
    pub occluders: &'a Occluders,
}

/// Returns the smallest standard deviation at depth 1 that a photo can resolve.
pub(crate) fn finest(camera: &Camera) -> f32 {
    (f64::from(FINEST) / camera.fx.max(camera.fy)) as f32
}

pub(crate) fn valid_pixels(photo: &[[u8; 4]]) -> u64 {
    photo.iter().filter(|pixel| pixel[3] > 127).count() as u64
}

/// Totals over an object's pixels that the label loss uses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObjectLight {
    /// Sum of r + g + b over these pixels of the photo.
    pub light: f64,
    /// Number of these pixels.
    pub pixels: u64,
}

/// Returns the mask in device layout: ids, with [`LABEL_BORDER`] set within `border` px of a contour.
pub(crate) fn view_labels(mask: &LabelMap, border: u32) -> Vec<u32> {
    let ids = mask.ids.iter().map(|&id| u32::from(id));
    if border == 0 {
        return ids.collect();
    }
    ids.zip(mask.near_contour(border)).map(|(id, near)| if near { id | LABEL_BORDER } else { id }).collect()
}

/// Sums light and area of each object, which give the label loss of an empty layer.
pub(crate) fn shown_objects(photo: &[[u8; 4]], view_labels: &[u32]) -> BTreeMap<u16, ObjectLight> {
    let mut objects: BTreeMap<u16, ObjectLight> = BTreeMap::new();
    for (&id, &[r, g, b, valid]) in view_labels.iter().zip(photo) {
        if id != 0 && id & LABEL_BORDER == 0 && valid > 127 {
            let shown = objects.entry(id as u16).or_default();
            shown.light += (f64::from(r) + f64::from(g) + f64::from(b)) / 255.0;
            shown.pixels += 1;
        }
    }
    objects
}

/// Returns the weights of the layers of a step: 1, or proportional to 1 / sqrt(area). An object of the mean area then
/// has weight 1; [`LAYER_WEIGHT_MAX`] is the upper bound.
pub(crate) fn layer_weights(input: &StepInput, view: StepView, config: &TrainConfig) -> Vec<f32> {
    let areas: Vec<f64> =
        input.layers.iter().map(|label| view.shown.get(label).map_or(0.0, |shown| shown.pixels as f64)).collect();
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let weight =
        |area: f64| if config.label_balance { (mean / area.max(1.0)).sqrt().min(LAYER_WEIGHT_MAX) } else { 1.0 };
    areas.into_iter().map(|area| weight(area) as f32).collect()
}

/// Returns the weighted label loss of a step from the device's sums.
pub fn label_loss(input: &StepInput, view: StepView, config: &TrainConfig, loss_label: f32) -> f64 {
    if input.layers.is_empty() {
        return f64::from(loss_label);
    }
    let empty = |(label, weight): (&u16, f32)| {
        let shown = view.shown.get(label).copied().unwrap_or_default();
        let opacity = f64::from(1.0 - ALPHA_SLACK) * shown.pixels as f64;
        f64::from(weight) * (shown.light + f64::from(alpha_weight(config)) * opacity)
    };
    let empty: f64 = input.layers.iter().zip(layer_weights(input, view, config)).map(empty).sum();
    (f64::from(loss_label) + empty) / (3.0 * view.valid_pixels.max(1) as f64) * f64::from(label_weight(input, config))
}

/// Returns the weight of a step's label loss. It stands for all steps until the next such step.
fn label_weight(input: &StepInput, config: &TrainConfig) -> f32 {
    let every = if input.layers.is_empty() { config.disagreement_every() } else { config.layer_every() };
    config.label_weight * every.max(1) as f32
}

/// The alpha term is a mean over pixels; the other terms are means over pixels and channels.
fn alpha_weight(config: &TrainConfig) -> f32 {
    3.0 * config.label_alpha
}

/// The input of a step. It is kept until the step is done, because the step may repeat after a buffer has grown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepInput {
    /// Step, from 1.
    pub step: u32,
    /// Index of the photo part; without bands, index of the training view.
    pub part: usize,
    /// Ids of the sampled objects; layer `j` of the render is `layers[j - 1]`. Empty in a step without layers.
    pub layers: Vec<u16>,
    /// True if the step has label passes.
    pub labels: bool,
    /// True if the step updates the parameters.
    pub update: bool,
    /// Number of updates, this one included.
    pub updates: u32,
}

impl StepInput {
    /// Returns what the step compares with the view. Known depths end before labels start.
    pub fn supervision(&self, config: &TrainConfig) -> Supervision {
        match (self.labels, self.layers.is_empty()) {
            (true, false) => Supervision::Layers { lift: config.label_rule == LabelRule::Main },
            (true, true) => Supervision::Disagreement,
            (false, _) if config.depth_weight_at(self.step) > 0.0 => Supervision::Depth,
            (false, _) => Supervision::Photo,
        }
    }
}

/// Scale of the scene, constant during training.
#[derive(Clone, Copy, Debug)]
pub struct SceneScale {
    /// Extent of the scene, world units.
    pub extent: f64,
}

pub(crate) fn uniforms(
    input: &StepInput,
    view: StepView,
    config: &TrainConfig,
    fixed: SceneScale,
    engine: &Engine,
) -> StepUniforms {
    let base = engine.part_uniforms(view.camera, view.whole, view.near, backdrop::colour(config, input.step));
    let rates = config.rates_at(input.step);
    let rate = (rates.position * fixed.extent) as f32;
    let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powi(input.updates.max(1) as i32))) as f32;
    let labels = engine.size().labels.map_or(0, |room| room.max_label + 1);
    StepUniforms {
        finest: view.finest,
        layer_count: input.layers.len() as u32,
        lambda_dssim: LAMBDA_DSSIM,
        loss_scale: (1.0 / (3.0 * view.valid_pixels.max(1) as f64)) as f32,
        label_weight: label_weight(input, config),
        label_alpha: alpha_weight(config),
        depth_weight: known_depths::weight(view.depths, config.depth_weight_at(input.step)),
        label_threshold: config.label_threshold,
        gpf: u32::from(config.gpf),
        occluder_words: labels.div_ceil(32),
        seed: (config.seed as u32) ^ input.step.wrapping_mul(0x9e37_79b9),
        adam_correction1: correction(ADAM_BETA1),
        adam_correction2: correction(ADAM_BETA2),
        rate_means: [rate, rate, rate, rates.opacity as f32],
        rate_scales: rates.scale as f32,
        rate_quats: rates.rotation as f32,
        rate_sh0: rates.colour as f32,
        rate_sh_rest: rates.colour_rest as f32,
        ..base
    }
}

/// Returns the device inputs of a step.
pub(crate) fn train_input<'a>(
    input: &StepInput,
    view: StepView<'a>,
    config: &TrainConfig,
    uniforms: StepUniforms,
    engine: &Engine,
) -> TrainInput<'a> {
    let room = engine.size().labels.filter(|_| input.labels);
    let (disagrees, layered) = if input.layers.is_empty() { (room, None) } else { (None, room) };
    let disagreement = disagrees.map(|_| view.view_labels);
    let layers = layered.map(|room| {
        let words = uniforms.occluder_words as usize;
        let mut layer_from_label = vec![0_u32; room.max_label as usize + 1];
        let mut label_from_layer = vec![0_u32; room.layers as usize + 1];
        let mut weights = vec![1.0_f32; room.layers as usize + 1];
        weights.iter_mut().skip(1).zip(layer_weights(input, view, config)).for_each(|(to, weight)| *to = weight);
        let mut occluders = vec![0_u32; words * (room.layers as usize + 1)];
        for (index, &label) in input.layers.iter().enumerate() {
            let layer = index + 1;
            layer_from_label[usize::from(label)] = layer as u32;
            label_from_layer[layer] = u32::from(label);
            for &occluder in view.occluders.get(&label).into_iter().flatten() {
                occluders[layer * words + usize::from(occluder / 32)] |= 1 << (occluder % 32);
            }
        }
        LayerInput { view_labels: view.view_labels, layer_from_label, label_from_layer, weights, occluders }
    });
    let photo = backdrop::photo(view.photo, config, input.step);
    let depths = (config.depth_weight_at(input.step) > 0.0).then_some(view.depths);
    TrainInput { uniforms, key: view.key, photo, layers, disagreement, depths, shared: Vec::new() }
}
