//! One step as the host prepares it: the uniforms, the photo, the masks.

use super::TrainConfig;
use crate::engine::Engine;
use crate::engine::uniforms::view_uniforms;
use crate::error::Result;
use crate::plan::Buf;
use crate::scene::{Camera, LabelMap, Occluders, Photo};
use crate::shaders::constants::{ADAM_BETA1, ADAM_BETA2};
use crate::shaders::structs::StepUniforms;
use std::collections::BTreeMap;

/// A view as training keeps it.
#[derive(Debug)]
pub struct TrainView {
    /// Name, for messages.
    pub name: String,
    /// Camera.
    pub camera: Camera,
    /// Photo.
    pub photo: Photo,
    /// Pixels of the photo that count.
    pub valid_pixels: u64,
    /// Masks, if the view has any.
    pub mask: Option<LabelMap>,
    /// Objects of the mask, sorted.
    pub objects: Vec<u16>,
    /// For each object the sum of r + g + b over its pixels of the photo: the label loss of an empty layer, not scaled.
    pub object_light: BTreeMap<u16, f64>,
    /// For each object, the objects that hide it in this view.
    pub occluders: Occluders,
}

/// Sum of r + g + b over the pixels of each object.
pub fn object_light(photo: &Photo, mask: Option<&LabelMap>) -> BTreeMap<u16, f64> {
    let mut light = BTreeMap::new();
    for (&id, &[r, g, b, valid]) in mask.into_iter().flat_map(|mask| mask.ids.iter().zip(&photo.rgba)) {
        if id != 0 && valid > 127 {
            *light.entry(id).or_insert(0.0) += (f64::from(r) + f64::from(g) + f64::from(b)) / 255.0;
        }
    }
    light
}

/// Label loss of a step, weighted, from what the device summed up.
pub fn label_loss(job: &Job, view: &TrainView, config: &TrainConfig, loss_label: f32) -> f64 {
    let empty: f64 = job.layers.iter().filter_map(|label| view.object_light.get(label)).sum();
    (f64::from(loss_label) + empty) / (3.0 * view.valid_pixels.max(1) as f64) * f64::from(config.label_weight)
}

/// What a step needs to be submitted, and submitted again after a buffer had to grow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
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
    /// Unique mark of the submit, never 0.
    pub stamp: u32,
}

/// What is the same for all steps.
#[derive(Clone, Copy, Debug)]
pub struct Fixed {
    /// Extent of the scene, world units.
    pub extent: f64,
}

/// The uniforms of a step.
pub fn uniforms(job: &Job, view: &TrainView, config: &TrainConfig, fixed: Fixed, engine: &Engine) -> StepUniforms {
    let count = engine.gaussian_count();
    let base = view_uniforms(&view.camera, engine.shape(), config.near, config.background, count);
    let rate = (config.position_lr(job.step) * fixed.extent) as f32;
    let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powi(job.updates.max(1) as i32))) as f32;
    let labels = engine.room().labels.map_or(0, |room| room.max_label + 1);
    StepUniforms {
        layer_count: job.layers.len() as u32,
        lambda_dssim: config.lambda_dssim,
        loss_scale: (1.0 / (3.0 * view.valid_pixels.max(1) as f64)) as f32,
        label_weight: config.label_weight,
        label_threshold: config.label_threshold,
        lift: u32::from(job.labels),
        gpf: u32::from(config.gpf),
        occluder_words: labels.div_ceil(32),
        stamp: job.stamp,
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

/// Writes everything of a step into a slot.
pub fn upload(engine: &mut Engine, slot: usize, uniforms: StepUniforms, view: &TrainView, job: &Job) -> Result<()> {
    let room = engine.room().labels;
    let sched = engine.sched_mut();
    sched.upload(Buf::STEP, slot, 0, &[uniforms])?;
    sched.upload(Buf::TARGET, slot, 0, &view.photo.rgba)?;
    let Some(room) = room.filter(|_| job.labels) else { return Ok(()) };
    let pixels = view.photo.rgba.len();
    let ids: Vec<u32> = match &view.mask {
        Some(mask) => mask.ids.iter().map(|&id| u32::from(id)).collect(),
        None => vec![0; pixels],
    };
    sched.upload(Buf::VIEW_LABELS, slot, 0, &ids)?;
    let words = uniforms.occluder_words as usize;
    let mut layer_from_label = vec![0_u32; room.max_label as usize + 1];
    let mut label_from_layer = vec![0_u32; room.layers as usize + 1];
    let mut hidden = vec![0_u32; words * (room.layers as usize + 1)];
    for (index, &label) in job.layers.iter().enumerate() {
        let layer = index + 1;
        layer_from_label[usize::from(label)] = layer as u32;
        label_from_layer[layer] = u32::from(label);
        for &occluder in view.occluders.get(&label).into_iter().flatten() {
            hidden[layer * words + usize::from(occluder / 32)] |= 1 << (occluder % 32);
        }
    }
    sched.upload(Buf::LAYER_FROM_LABEL, slot, 0, &layer_from_label)?;
    sched.upload(Buf::LABEL_FROM_LAYER, slot, 0, &label_from_layer)?;
    sched.upload(Buf::LAYER_OCCLUDERS, slot, 0, &hidden)
}
