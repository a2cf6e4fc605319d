//! One step as the host prepares it: the uniforms, the photo, the masks.

use super::TrainConfig;
use super::config::LabelRule;
use crate::engine::{Engine, LayerInput, TrainInput};
use crate::io::resample::shrink_photo;
use crate::scene::{Camera, LabelMap, Occluders, Photo};
use crate::shaders::constants::{ADAM_BETA1, ADAM_BETA2, LABEL_BORDER};
use crate::shaders::structs::StepUniforms;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest weight of a small object beside large ones.
const WEIGHT_MAX: f64 = 10.0;

/// A view as training keeps it.
#[derive(Debug)]
pub struct TrainView {
    /// Name, for messages.
    pub name: String,
    /// Camera.
    pub camera: Camera,
    /// Photo.
    pub photo: Arc<Photo>,
    /// Pixels of the photo that count.
    pub valid_pixels: u64,
    /// Masks, if the view has any.
    pub mask: Option<Arc<LabelMap>>,
    /// Objects of the mask, sorted.
    pub objects: Vec<u16>,
    /// The mask as the device reads it; empty without a mask.
    pub view_labels: Vec<u32>,
    /// What each object shows of itself.
    pub shown: BTreeMap<u16, Shown>,
    /// For each object, the objects that hide it in this view.
    pub occluders: Occluders,
}

impl TrainView {
    /// The same view at half the size, without its masks.
    pub fn halved(&self) -> Self {
        let (width, height) = (self.camera.width.div_ceil(2), self.camera.height.div_ceil(2));
        let photo = shrink_photo(&self.photo, width, height);
        Self {
            name: self.name.clone(),
            camera: self.camera.resized(width, height),
            valid_pixels: valid_pixels(&photo),
            photo: Arc::new(photo),
            mask: None,
            objects: Vec::new(),
            view_labels: Vec::new(),
            shown: BTreeMap::new(),
            occluders: Occluders::new(),
        }
    }
}

/// Pixels of a photo that count.
pub(crate) fn valid_pixels(photo: &Photo) -> u64 {
    photo.rgba.iter().filter(|pixel| pixel[3] > 127).count() as u64
}

/// What an object shows in a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Sum of r + g + b over its pixels of the photo that the label loss looks at.
    pub light: f64,
    /// Number of these pixels.
    pub pixels: u64,
}

/// The mask as the device reads it: ids, with [`LABEL_BORDER`] within `border` px of a contour.
pub(crate) fn view_labels(mask: &LabelMap, border: u32) -> Vec<u32> {
    let ids = mask.ids.iter().map(|&id| u32::from(id));
    if border == 0 {
        return ids.collect();
    }
    ids.zip(mask.near_contour(border)).map(|(id, near)| if near { id | LABEL_BORDER } else { id }).collect()
}

/// What each object shows of itself: the label loss of an empty layer.
pub(crate) fn shown_objects(photo: &Photo, view_labels: &[u32]) -> BTreeMap<u16, Shown> {
    let mut objects: BTreeMap<u16, Shown> = BTreeMap::new();
    for (&id, &[r, g, b, valid]) in view_labels.iter().zip(&photo.rgba) {
        if id != 0 && id & LABEL_BORDER == 0 && valid > 127 {
            let shown = objects.entry(id as u16).or_default();
            shown.light += (f64::from(r) + f64::from(g) + f64::from(b)) / 255.0;
            shown.pixels += 1;
        }
    }
    objects
}

/// Weights of the layers of a step: 1, or as one over the root of the object's area, with a mean of 1 over an area of
/// the mean size and at most [`WEIGHT_MAX`].
pub(crate) fn layer_weights(input: &StepInput, view: &TrainView, config: &TrainConfig) -> Vec<f32> {
    let areas: Vec<f64> =
        input.layers.iter().map(|label| view.shown.get(label).map_or(0.0, |shown| shown.pixels as f64)).collect();
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let weight = |area: f64| if config.label_balance { (mean / area.max(1.0)).sqrt().min(WEIGHT_MAX) } else { 1.0 };
    areas.into_iter().map(|area| weight(area) as f32).collect()
}

/// Label loss of a step, weighted, from what the device summed up.
pub fn label_loss(input: &StepInput, view: &TrainView, config: &TrainConfig, loss_label: f32) -> f64 {
    let empty = |(label, weight): (&u16, f32)| {
        let shown = view.shown.get(label).copied().unwrap_or_default();
        f64::from(weight) * (shown.light + f64::from(alpha_weight(config)) * shown.pixels as f64)
    };
    let empty: f64 = input.layers.iter().zip(layer_weights(input, view, config)).map(empty).sum();
    (f64::from(loss_label) + empty) / (3.0 * view.valid_pixels.max(1) as f64) * f64::from(config.label_weight)
}

/// The alpha term is a mean over pixels, where the others are means over pixels and channels.
fn alpha_weight(config: &TrainConfig) -> f32 {
    3.0 * config.label_alpha
}

/// What a step needs to be submitted, and submitted again after a buffer had to grow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepInput {
    /// Step, from 1.
    pub step: u32,
    /// Index of the view.
    pub view: usize,
    /// Sampled objects; layer j is `layers[j - 1]`.
    pub layers: Vec<u16>,
    /// Labels are in the list.
    pub labels: bool,
    /// Parameters are updated.
    pub update: bool,
    /// Updates so far, this one included.
    pub updates: u32,
}

impl StepInput {
    /// True if the paper's lift is in the step.
    pub fn lifts(&self, config: &TrainConfig) -> bool {
        self.labels && config.label_rule == LabelRule::Main
    }
}

/// What is the same for all steps.
#[derive(Clone, Copy, Debug)]
pub struct SceneScale {
    /// Extent of the scene, world units.
    pub extent: f64,
}

/// The uniforms of a step.
pub(crate) fn uniforms(
    input: &StepInput,
    view: &TrainView,
    config: &TrainConfig,
    fixed: SceneScale,
    engine: &Engine,
) -> StepUniforms {
    let base = engine.view_uniforms(&view.camera, config.near, config.background);
    let rate = (config.position_lr(input.step) * fixed.extent) as f32;
    let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powi(input.updates.max(1) as i32))) as f32;
    let labels = engine.size().labels.map_or(0, |room| room.max_label + 1);
    StepUniforms {
        layer_count: input.layers.len() as u32,
        lambda_dssim: config.lambda_dssim,
        loss_scale: (1.0 / (3.0 * view.valid_pixels.max(1) as f64)) as f32,
        label_weight: config.label_weight,
        label_alpha: alpha_weight(config),
        label_threshold: config.label_threshold,
        gpf: u32::from(config.gpf),
        occluder_words: labels.div_ceil(32),
        seed: (config.seed as u32) ^ input.step.wrapping_mul(0x9e37_79b9),
        adam_correction1: correction(ADAM_BETA1),
        adam_correction2: correction(ADAM_BETA2),
        rate_means: [rate, rate, rate, config.opacity_lr as f32],
        rate_scales: config.scaling_lr as f32,
        rate_quats: config.rotation_lr as f32,
        rate_sh0: config.feature_lr as f32,
        rate_sh_rest: config.feature_rest_lr() as f32,
        ..base
    }
}

/// What the device reads of a step.
pub(crate) fn train_input<'a>(
    input: &StepInput,
    view: &'a TrainView,
    config: &TrainConfig,
    uniforms: StepUniforms,
    engine: &Engine,
) -> TrainInput<'a> {
    let room = engine.size().labels.filter(|_| input.labels);
    let layers = room.map(|room| {
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
        LayerInput { view_labels: &view.view_labels, layer_from_label, label_from_layer, weights, occluders }
    });
    TrainInput { uniforms, photo: &view.photo.rgba, layers, shared: Vec::new() }
}
