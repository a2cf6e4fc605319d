//! The optimiser, densification and the opacity reset.

use super::rig::{MOMENTS_1, MOMENTS_2, PARAMETERS, Rig, prove};
use crate::reference::Row;
use crate::reference::adam::{Optimised, Rates, adam};
use crate::reference::densify::{Origin, Population, densify, mark, opacity_reset};
use crate::reference::model::ROW_FLOATS;
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::device;
use crate::support::scenes::{Shape, population, scene};
use labelgs::engine::ListKey;
use labelgs::plan::Buf;
use labelgs::scene::Gaussians;
use labelgs::selftest::judge;
use labelgs::shaders::structs::StepUniforms;
use labelgs::train::TrainConfig;
use labelgs::train::job::Fixed;

fn states(rig: &mut Rig) -> Vec<Optimised> {
    let count = rig.scene.gaussians.len();
    let (rows, m, u) = (rig.rows(PARAMETERS, count), rig.rows(MOMENTS_1, count), rig.rows(MOMENTS_2, count));
    (0..count).map(|i| Optimised { row: rows[i], m: m[i], u: u[i] }).collect()
}

/// Five steps, each from the state that the device had before it.
#[test]
fn adam_of_every_attribute() {
    let Some(turn) = device() else { return };
    let mut rig = Rig::new(turn, scene(101, &Shape { gaussians: 60, ..Shape::default() }), true);
    rig.fixed = Fixed { extent: 4.0 };
    rig.job.update = true;
    let mut steps = Vec::new();
    for step in 1..=5 {
        (rig.job.step, rig.job.updates, rig.job.stamp) = (step, step, step);
        let before = states(&mut rig);
        rig.train();
        steps.push((step, rig.uniforms(), before, rig.gradient_rows(), states(&mut rig)));
    }
    prove("adam", &["adam_beta1", "adam_beta2", "adam_eps"], |rules| {
        judge::all(steps.iter().map(|(step, u, before, gradients, after)| {
            let [means, opacity] = [u.rate_means[0], u.rate_means[3]];
            let rest = u.rate_sh_rest;
            let rates =
                Rates([means, u.rate_quats, u.rate_scales, opacity, u.rate_sh0, rest, rest, rest].map(f64::from));
            let mirror = |(state, gradient)| adam(rules, &rates, *step, state, gradient);
            let expected: Vec<Optimised> = before.iter().zip(gradients).map(mirror).collect();
            judge::updates(after, &expected, &rates)
        }))
    });
}

fn pcg_hash(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn uniform_draw(seed: u32, index: u32, draw: u32) -> f64 {
    let hash = pcg_hash(pcg_hash(pcg_hash(seed).wrapping_add(index)).wrapping_add(draw));
    (f64::from(hash >> 8) + 0.5) / 16_777_216.0
}

/// glsl/include/random.glsl in f64.
fn normal_draw(seed: u32, index: u32, draw: u32) -> f64 {
    let radius = (-2.0 * uniform_draw(seed, index, 2 * draw).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform_draw(seed, index, 2 * draw + 1)).cos()
}

#[test]
fn draws_are_standard_normal() {
    let draws: Vec<f64> = (0..40_000).map(|i| normal_draw(17, i / 6, i % 6)).collect();
    let mean = |f: &dyn Fn(f64) -> f64| draws.iter().map(|&v| f(v)).sum::<f64>() / draws.len() as f64;
    assert!(
        mean(&|v| v).abs() < 0.015 && (mean(&|v| v * v) - 1.0).abs() < 0.03 && (mean(&|v| v.powi(4)) - 3.0).abs() < 0.2
    );
    let neighbours = draws.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / draws.len() as f64;
    assert!(neighbours.abs() < 0.015);
}

/// A population as a model to upload.
fn gaussians(population: &Population) -> Gaussians {
    let narrow = |v: f64| v as f32;
    let rows = &population.model.rows;
    Gaussians {
        origin: glam::DVec3::ZERO,
        means: rows.iter().map(|r| r.mean.map(narrow)).collect(),
        quats: rows.iter().map(|r| r.quat.map(narrow)).collect(),
        scales: rows.iter().map(|r| r.scale.map(narrow)).collect(),
        opacities: rows.iter().map(|r| narrow(r.opacity)).collect(),
        sh0: rows.iter().map(|r| r.sh[0].map(narrow)).collect(),
        sh_rest: rows.iter().flat_map(|r| r.sh[1..].iter().map(|c| c.map(narrow))).collect(),
        sh_degree: 3,
        labels: Some(population.model.labels.clone()),
        label_confidence: None,
    }
}

const SEED: u32 = 0x1234_5678;

/// The device's population before, and the uniforms of a densification at `step` in a scene of extent 1.
fn densifying(rig: &mut Rig, before: &Population, step: u32) -> StepUniforms {
    rig.put_rows(MOMENTS_1, &before.m);
    rig.put_rows(MOMENTS_2, &before.u);
    let stats: Vec<[f32; 2]> =
        before.gradient_sum.iter().zip(&before.gradient_count).map(|(&s, &n)| [s as f32, n as f32]).collect();
    rig.engine.sched_mut().upload(Buf::DENSIFY_STATS, 0, 0, &stats).expect("upload");
    let (config, with_resets) = (&rig.config, TrainConfig::paper());
    StepUniforms {
        densify_threshold: config.densify_grad_threshold,
        densify_scale: config.percent_dense,
        prune_scale: config.max_scale,
        prune_opacity: config.min_opacity,
        prune_big: u32::from(with_resets.prunes_large_at(step)),
        seed: SEED,
        ..rig.uniforms()
    }
}

fn densify_case(step: u32, bearing: &[&str]) {
    let Some(turn) = device() else { return };
    let before = population(110 + u64::from(step), 500);
    let mut s = scene(1, &Shape { gaussians: 1, ..Shape::default() });
    s.gaussians = gaussians(&before);
    let mut rig = Rig::new(turn, s, true);
    rig.engine.make_room_for_gaussians(1001).expect("room for all children");
    let uniforms = densifying(&mut rig, &before, step);
    let upload = |rig: &mut labelgs::selftest::rig::Rig| rig.engine.sched_mut().upload(Buf::STEP, 0, 0, &[uniforms]);
    let counted = rig.run(ListKey::DensifyCount, upload).counters;
    let marks = rig.get::<u32>(Buf::CHILDREN_COUNTS, before.model.rows.len());
    let applied = rig.run(ListKey::DensifyApply, upload).counters;
    let count = counted.densified_count as usize;
    assert_eq!(counted, applied, "counting and applying decide alike");
    let after = [PARAMETERS, MOMENTS_1, MOMENTS_2].map(|planes| rig.rows(planes, count));
    let labels = rig.get::<u32>(Buf::LABELS, count);
    let stats = rig.get::<f32>(Buf::DENSIFY_STATS, 2 * count);
    assert!(stats.iter().all(|&v| v == 0.0), "statistics start over");
    prove(&format!("densify at {step}"), bearing, |rules| {
        let normal = |row: usize, child: u32, axis: usize| normal_draw(SEED, row as u32, 3 * child + axis as u32);
        let expected = densify(rules, &before, 1.0, step, normal);
        let nearest = expected.margins.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(nearest > 1e-6, "a decision of this seed is too near to a threshold: {nearest}");
        exact(&marks, &mark(rules, &before, 1.0, step))?;
        exact(&labels, &expected.model.labels)?;
        let of = |origin: Origin| expected.origins.iter().filter(|(_, o)| *o == origin).count() as u32;
        exact(&[counted.cloned_count, counted.split_count], &[of(Origin::Clone), of(Origin::Child(1))])?;
        let rows = [&expected.model.rows, &expected.m, &expected.u];
        let floats = |rows: &[Row]| -> Vec<f64> { rows.iter().flat_map(Row::floats).collect() };
        // Everything is copied but the places and scales of children.
        exact(&floats(&after[1]), &floats(rows[1]))?;
        exact(&floats(&after[2]), &floats(rows[2]))?;
        // 0.23 of (1e-6, 1e-7) seen.
        close(&floats(&after[0]), &floats(rows[0]), Tolerance { absolute: 3.5e-7, relative: 3.5e-8 })
    });
    assert_eq!(after[0].len() * ROW_FLOATS, count * ROW_FLOATS);
}

#[test]
fn densify_early() {
    let bearing = ["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale_after"];
    densify_case(600, &bearing);
}

#[test]
fn densify_late_removes_the_huge() {
    densify_case(3100, &["densify_gradient", "percent_dense", "split_shrink", "prune_opacity", "prune_scale"]);
}

#[test]
fn opacity_reset_of_a_population() {
    let Some(turn) = device() else { return };
    let before = population(120, 300);
    let mut s = scene(1, &Shape { gaussians: 1, ..Shape::default() });
    s.gaussians = gaussians(&before);
    let mut rig = Rig::new(turn, s, true);
    let uniforms = densifying(&mut rig, &before, 3000);
    rig.run(ListKey::OpacityReset, |rig| rig.engine.sched_mut().upload(Buf::STEP, 0, 0, &[uniforms]));
    let after = states(&mut rig);
    prove("opacity reset", &["reset_opacity"], |rules| {
        let mut pairs = (Vec::new(), Vec::new());
        for (i, after) in after.iter().enumerate() {
            let (mut row, mut m, mut u) = (before.model.rows[i], before.m[i], before.u[i]);
            opacity_reset(rules, &mut row, &mut m, &mut u);
            pairs.0.extend([after.row, after.m, after.u].iter().flat_map(Row::floats));
            pairs.1.extend([row, m, u].iter().flat_map(Row::floats));
        }
        // The constant is the logit of 0.01, not of the nearest f32; 8e-8 seen.
        close(&pairs.0, &pairs.1, Tolerance { absolute: 1.2e-7, relative: 0.0 })
    });
    check("labels", exact(&rig.get::<u32>(Buf::LABELS, 300), &before.model.labels));
}
