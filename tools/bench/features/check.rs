//! The feature kernels against the weights of the float64 mirror, on a scene of a few hundred Gaussians.

use super::kernels::{Channels, Kernels};
use super::{Bed, Ground, feature};
use crate::measure::require;
use crate::trained::{labelled_model, small_scene, timing_config, trainer, without_masks};
use labelgs::Result;
use labelgs::gpu::Gpu;
use labelgs::scheduler::plan::Buf;
use labelgs::synth;
use labelgs::verify::reference::Rules;
use labelgs::verify::reference::blend::{Trace, smallest_over_pixels, trace};
use labelgs::verify::reference::splat::Splat;
use labelgs::verify::selftest::fixture::splat_of;
use std::sync::Arc;

/// Pixels with a decision nearer than this to its threshold are left out, and gradients of splats in them: both sides
/// decide from the same f32 records, so only the rounding of exponents and transmittances stands between them.
const MARGIN: f64 = 1e-5;
/// Largest error of a feature: sums of some hundred f32 terms of at most 1; exponents are f32 too.
const FORWARD: f64 = 1e-4;
/// The same of a gradient, in units of the sum of its terms' sizes.
const BACKWARD: f64 = 1e-4;
/// Largest relative difference of <f, v_f> and <F, v_F>, over all pixels.
const ADJOINT: f64 = 1e-4;

/// Checks one number of channels of each kind.
pub fn run(gpu: &Arc<Gpu>, kernels: &Kernels) -> Result<()> {
    let scene = small_scene();
    let dataset = synth::dataset(&scene, 0);
    let model = labelled_model(gpu, &dataset, 12)?;
    let mut steps = trainer(gpu, &without_masks(&dataset), &model, timing_config())?;
    for _ in 0..dataset.train.len() {
        steps.step()?;
    }
    steps.drain()?;
    let capacity = *steps.engine_mut().raw().capacity();
    let size = (scene.width, scene.height);
    let ground = Ground { gpu, kernels, model: &model, capacity, size };
    for (count, vecs) in [(3, 1), (16, 2), (40, 4)] {
        let mut bed = Bed::new(&ground, Channels { count, vecs }, false)?;
        let counters = bed.step(&dataset.train[0], true)?;
        compare(&mut bed, counters.visible_count as usize, size)?;
    }
    println!("features and their gradients agree with the float64 mirror\n");
    Ok(())
}

/// Compares the channels of the last walk, whose picture is still there.
fn compare(bed: &mut Bed, visible: usize, (width, height): (u32, u32)) -> Result<()> {
    let (width, height) = (width as usize, height as usize);
    let lanes = 4 * bed.channels.vecs as usize;
    let floats = 4 * bed.channels.stride() as usize;
    let first = floats - lanes;
    let order = bed.sched.download::<u32>(Buf::DEPTH_VALUES_A, 0, 0, visible)?;
    let records = bed.sched.download::<[f32; 12]>(Buf::SPLATS, 0, 0, visible)?;
    let splats: Vec<Splat> = order.iter().zip(&records).map(|(&gaussian, record)| splat_of(gaussian, record)).collect();
    let v_image = bed.sched.download::<f32>(bed.buffers.v_image, 0, 0, width * height * lanes)?;
    let v_features = bed.sched.download::<f32>(bed.buffers.v_features, 0, 0, visible * floats)?;
    let value =
        |splat: usize, lane: usize| f64::from(feature(order[splat] as usize, (first + lane) as u32, bed.channels));

    let rules = Rules::default();
    let centre = |p: usize| [(p % width) as f64 + 0.5, (p / width) as f64 + 0.5];
    let rays: Vec<Trace> = (0..width * height).map(|p| trace(&rules, splats.iter().enumerate(), centre(p))).collect();
    let margins: Vec<f64> = rays.iter().map(|ray| ray.margins.image()).collect();
    let mut worst = 0.0_f64;
    let (mut by_picture, mut by_features) = (0.0, 0.0);
    let mut expected = vec![(0.0, 0.0); visible * lanes];
    for (p, ray) in rays.iter().enumerate() {
        for lane in 0..lanes {
            let gradient = f64::from(v_image[p * lanes + lane]);
            let rendered = gradient + f64::from(wanted(p % width, p / width, first + lane));
            let blended: f64 = ray.contributions.iter().map(|c| c.weight() * value(c.splat, lane)).sum();
            // The target is a fraction: f32 may round it across a whole number.
            let error = (rendered - blended).abs();
            let error = error.min((error - 1.0).abs());
            worst = worst.max(if margins[p] > MARGIN { error } else { 0.0 });
            by_picture += gradient * blended;
            for c in &ray.contributions {
                let sum = &mut expected[c.splat * lanes + lane];
                *sum = (sum.0 + c.weight() * gradient, sum.1 + (c.weight() * gradient).abs());
            }
        }
    }
    require(worst < FORWARD, || format!("a feature is off by {worst:.2e}"))?;
    let sure = smallest_over_pixels(&rules, &splats, (width, height), &margins);
    require(sure.iter().filter(|&&margin| margin > MARGIN).count() * 2 > visible, || "few splats are sure".to_owned())?;
    for splat in 0..visible {
        for lane in 0..lanes {
            let found = f64::from(v_features[splat * floats + first + lane]);
            let (sum, size) = expected[splat * lanes + lane];
            by_features += found * value(splat, lane);
            require(sure[splat] <= MARGIN || (found - sum).abs() <= BACKWARD * size + 1e-6, || {
                format!("the gradient of splat {splat}, channel {}, is {found}, not {sum}", first + lane)
            })?;
        }
    }
    require((by_features - by_picture).abs() <= ADJOINT * by_picture.abs().max(1.0), || {
        format!("the backward pass is not the adjoint of the forward one: {by_features} and {by_picture}")
    })
}

/// `wanted` of feature_forward.comp.
fn wanted(x: usize, y: usize, channel: usize) -> f32 {
    (0.37 * channel as f32 + 0.013 * x as f32 + 0.007 * y as f32).fract()
}
