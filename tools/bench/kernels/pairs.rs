//! Accuracy of the gradient of a (pixel, splat) pair with respect to its opacity: of the device, which carries the
//! light from behind as a sum, and of two f32 methods on the host, one with sums and one with differences between the
//! total and the front.

use crate::measure::{quantile, table};
use glam::DMat3;
use labelgs::gpu::Gpu;
use labelgs::pass::KernelShape;
use labelgs::reference::Rules;
use labelgs::reference::blend::{Upstream, blend_backward, trace};
use labelgs::reference::loss::Photo;
use labelgs::reference::step::Target;
use labelgs::scene::{Camera, Gaussians};
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::fixture::{Fixture, readable};
use labelgs::verify::selftest::scenes::{Scene, generator, uniform};
use labelgs::{Error, Result};
use serde_json::{Value, json};
use std::sync::Arc;

/// Lengths of the splat lists: most splats are faint, and the end is opaque.
const LIST_LENGTHS: [usize; 2] = [300, 1_000];
/// Centre of the only pixel.
const PIXEL_CENTRE: [f64; 2] = [0.5; 2];
/// Largest error of 99 % of the device's pairs; observed 1.5e-5, and 1.3e-3 by differences.
const ERROR_MAX: f64 = 1e-4;
/// Margin of a list's decisions, so that device and mirror decide alike.
const MARGIN_MIN: f64 = 1e-5;

/// Prints and returns the errors of `lists` lists of each length. Errors if the device's are too large.
pub fn run(gpu: &Arc<Gpu>, lists: usize) -> Result<Vec<Value>> {
    let own = KernelShape { group_blend: None, ..KernelShape::for_device(gpu.capabilities()) };
    let groups = own.with_group_blend(gpu.capabilities());
    let (device, [sums, differences]) = errors(gpu, own, lists)?;
    let mut ways = vec![("device, by tiles", device)];
    if let Some(groups) = groups {
        ways.push(("device, by chunks", errors(gpu, groups, lists)?.0));
    }
    ways.extend([("f32, by sums", sums), ("f32, by differences", differences)]);
    let mut rows = vec![["relative error of a pair", "pairs", "median", "99 %", "max"].map(str::to_owned).to_vec()];
    let mut found = Vec::new();
    for (name, mut errors) in ways {
        let numbers = [0.5, 0.99, 1.0].map(|share| quantile(&mut errors, share));
        if errors.is_empty() || name.starts_with("device") && !(numbers[1] <= ERROR_MAX) {
            return Err(Error::Check(format!("{name}: gradients of {} pairs, off by {numbers:?}", errors.len())));
        }
        rows.push(
            [vec![name.to_owned(), errors.len().to_string()], numbers.map(|v| format!("{v:.1e}")).to_vec()].concat(),
        );
        found.push(
            json!({ "way": name, "pairs": errors.len(), "median": numbers[0], "p99": numbers[1], "max": numbers[2] }),
        );
    }
    println!(
        "\ngradient of a pair of a pixel and a splat with respect to its opacity, lists of {LIST_LENGTHS:?} splats"
    );
    println!("{}", table(&rows));
    Ok(found)
}

/// Returns the relative errors of the device and of both host methods.
fn errors(gpu: &Arc<Gpu>, shape: KernelShape, lists: usize) -> Result<(Vec<f64>, [Vec<f64>; 2])> {
    let (rules, mut device, mut models) = (Rules::default(), Vec::new(), [Vec::new(), Vec::new()]);
    for length in LIST_LENGTHS {
        let mut fixture = Fixture::new(Arc::clone(gpu), list(0, length), false, shape, readable())?;
        for seed in 0..lists as u64 {
            fixture.engine.upload_model(&list(seed, length).gaussians)?;
            fixture.train()?;
            let (splats, background) = (fixture.splats()?, fixture.scene.target.background);
            let gradient = fixture.get::<[f32; 4]>(Buf::V_IMAGE, 1)?[0].map(f64::from);
            let gradient = [gradient[0], gradient[1], gradient[2]];
            let actual = fixture.splat_gradients(&splats)?;
            let upstream = Upstream::from_colours(&[gradient]);
            let expected = blend_backward(&rules, &splats, (1, 1), background, &upstream).values;
            let ray = trace(&rules, splats.iter().enumerate(), PIXEL_CENTRE);
            if ray.margins.gradient() < MARGIN_MIN {
                continue;
            }
            let pairs: Vec<(f32, f32)> = (ray.contributions.iter())
                .map(|of| (of.alpha as f32, light(&splats[of.splat].colour, &gradient)))
                .collect();
            let by_opacity =
                ray.contributions.iter().map(|of| expected[of.splat].opacity * splats[of.splat].opacity / of.alpha);
            let by_opacity: Vec<f64> = by_opacity.collect();
            for (model, way) in models.iter_mut().zip([by_sums, by_differences]) {
                let found = way(&pairs, light(&background, &gradient));
                model.extend(found.into_iter().zip(&by_opacity).map(|(a, e)| (f64::from(a) / e - 1.0).abs()));
            }
            let of_device = |at: usize| (actual[at].opacity / expected[at].opacity - 1.0).abs();
            device.extend(ray.contributions.iter().map(|of| of_device(of.splat)));
        }
    }
    Ok((device, models))
}

fn light(colour: &[f64; 3], gradient: &[f64; 3]) -> f32 {
    colour.iter().zip(gradient).map(|(c, g)| *c as f32 * *g as f32).sum()
}

/// Back to front, like the backward walk: the light from behind is the sum of what is there, divided by the
/// transmittance.
fn by_sums(pairs: &[(f32, f32)], background: f32) -> Vec<f32> {
    let (mut t, mut behind) = (pairs.iter().fold(1.0, |t, (alpha, _)| t * (1.0 - alpha)), background);
    let back = pairs.iter().rev().map(|(alpha, light)| {
        t /= 1.0 - alpha;
        let difference = light - behind;
        behind += alpha * difference;
        t * difference
    });
    let mut found: Vec<f32> = back.collect();
    found.reverse();
    found
}

/// Front to back, like trainers with a workgroup per part of a list: what is behind is the total minus the front.
fn by_differences(pairs: &[(f32, f32)], background: f32) -> Vec<f32> {
    let blend = |(sum, t): (f32, f32), &(alpha, light): &(f32, f32)| (sum + alpha * t * light, t * (1.0 - alpha));
    let (sum, rest) = pairs.iter().fold((0.0, 1.0), blend);
    let (whole, mut front) = (sum + rest * background, (0.0, 1.0));
    let gradient = |pair: &(f32, f32)| {
        let before = front.1;
        front = blend(front, pair);
        before * pair.1 - (whole - front.0) / (1.0 - pair.0)
    };
    pairs.iter().map(gradient).collect()
}

/// A single pixel, with splats in front of it in random order.
fn list(seed: u64, length: usize) -> Scene {
    let focal = 64.0;
    let (rotation, translation) = (DMat3::IDENTITY, glam::DVec3::ZERO);
    let camera = Camera { rotation, translation, fx: focal, fy: focal, cx: 0.5, cy: 0.5, width: 1, height: 1 };
    let (mut random, mut gaussians) = (generator(77 + seed), Gaussians::default());
    for index in 0..length {
        let mut draw = |low: f64, high: f64| uniform(&mut random, low, high);
        let depth = 2.0 + 6.0 * (index as f64 + draw(0.0, 1.0)) / length as f64;
        // All faint splats together transmit the same, whatever the length.
        let faint = (4.0 * draw(0.05, 1.0).powi(3) / length as f64 * 4.0).max(0.005);
        let opacity = if index * 50 < length * 49 { faint } else { draw(0.3, 0.95) };
        gaussians
            .means
            .push([draw(-1.0, 1.0) * depth / focal, draw(-1.0, 1.0) * depth / focal, depth].map(|v| v as f32));
        gaussians.quats.push([1.0, 0.0, 0.0, 0.0]);
        gaussians.scales.push([(draw(2.0, 8.0) * depth / focal).ln() as f32; 3]);
        gaussians.opacities.push((opacity / (1.0 - opacity)).ln() as f32);
        gaussians.sh0.push([0; 3].map(|_| draw(-1.5, 1.5) as f32));
    }
    let photo = Photo { size: (1, 1), colours: vec![[0.25, 0.5, 0.75]], valid: vec![true] };
    let target = Target { photo, label_map: vec![0], slots: Vec::new(), background: [0.25, 0.5, 0.125] };
    Scene { camera, gaussians, target, frozen: 0 }
}
