//! Compares the device with the reference: `labelgs selftest` runs these checks, and the tests use them.

pub mod antialias;
mod checks;
pub mod compare;
pub mod exposure;
pub mod fixture;
pub mod judge;
pub mod model;
pub mod pose;
pub mod relocation;
pub mod scenes;
mod training;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::verify::reference::Rules;
use checks::Ran;
use compare::Verdict;
use std::sync::Arc;
use std::time::Instant;

/// One check of the self-test.
#[derive(Clone, Debug)]
pub struct Check {
    /// Name of the check.
    pub name: String,
    /// Measured errors, or the failure.
    pub verdict: Verdict,
    /// Duration in seconds, including compilation by the driver.
    pub seconds: f64,
}

impl Check {
    /// Largest error in units of its bound; `None` after a failure.
    pub fn worst(&self) -> Option<f64> {
        self.verdict.as_ref().ok().map(|summary| summary.worst.max(summary.whole))
    }
}

/// Runs every check on a device and passes each to `done` when it ends. An error is a failure of the device itself,
/// such as a lack of memory.
pub fn run(gpu: &Arc<Gpu>, done: impl FnMut(Check)) -> Result<()> {
    run_against(&Rules::default(), gpu, done)
}

/// Same as [`run`], against different rules, to prove that the checks can fail.
pub fn run_against(rules: &Rules, gpu: &Arc<Gpu>, mut done: impl FnMut(Check)) -> Result<()> {
    let kernels = KernelShape::of(gpu.capabilities());
    let other = KernelShape { texel: !kernels.texel, ..kernels };
    passes(rules, gpu, kernels, "", &mut done)?;
    passes(rules, gpu, other, if other.texel { ", texel reads" } else { ", storage reads" }, &mut done)?;
    changes(rules, gpu, kernels, &mut done)?;
    wholes(gpu, kernels, &mut done)
}

/// Runs the checks of a long list and of a training.
pub fn wholes(gpu: &Arc<Gpu>, kernels: KernelShape, mut done: impl FnMut(Check)) -> Result<()> {
    type Whole = fn(&Arc<Gpu>, KernelShape) -> Result<Verdict>;
    let wholes: [(&str, Whole); 2] =
        [("70,000 splats in a tile", checks::long_list), ("training twice, bit by bit", training::twice)];
    for (name, whole) in wholes {
        let start = Instant::now();
        let verdict = whole(gpu, kernels)?;
        done(Check { name: name.to_owned(), verdict, seconds: start.elapsed().as_secs_f64() });
    }
    Ok(())
}

/// Runs the checks of the passes of a step, with kernels of a shape. `suffix` follows their names.
pub fn passes(
    rules: &Rules,
    gpu: &Arc<Gpu>,
    kernels: KernelShape,
    suffix: &str,
    mut done: impl FnMut(Check),
) -> Result<()> {
    let start = Instant::now();
    let mut ran = Ran::new(rules, gpu, kernels)?;
    let prepared = start.elapsed().as_secs_f64();
    type Pass = fn(&mut Ran) -> Result<Verdict>;
    let passes: [(&str, Pass); 14] = [
        ("depth order", Ran::order),
        ("projection", Ran::projection),
        ("tile lists", Ran::tiles),
        ("blend forward", Ran::blend),
        ("photo loss and its gradient", Ran::loss),
        ("votes", Ran::votes),
        ("votes of Gaussians alone", Ran::votes_alone),
        ("label map", Ran::label_map),
        ("blend backward", Ran::blend_backward),
        ("disagreement of labels", Ran::disagreement),
        ("weights of Gaussians", Ran::weights),
        ("gradient of a step with labels", Ran::gradient),
        ("the same step twice, bit by bit", Ran::repeated),
        ("Adam", Ran::adam),
    ];
    for (index, (name, pass)) in passes.into_iter().enumerate() {
        let start = Instant::now();
        let verdict = pass(&mut ran)?;
        let before = if index == 0 { prepared } else { 0.0 };
        done(Check { name: format!("{name}{suffix}"), verdict, seconds: start.elapsed().as_secs_f64() + before });
    }
    Ok(())
}

/// Runs the checks of passes that change the model.
pub fn changes(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, mut done: impl FnMut(Check)) -> Result<()> {
    type Change = fn(&Rules, &Arc<Gpu>, KernelShape, f64) -> Result<Verdict>;
    let changes: [(&str, Change); 11] = [
        ("densification", model::densification),
        ("densification along the longest axis", model::long_splits),
        ("marks of fog", model::fog_of_a_step),
        ("relocation", relocation::relocation),
        ("random moves", relocation::exploration),
        ("reset of opacities", model::reset),
        ("exposure of a photo", exposure::exposure_of_a_step),
        ("pose of a photo", pose::pose_of_a_step),
        ("antialiased splats and their gradient", antialias::splats_of_a_step),
        ("least sizes of Gaussians", antialias::sizes_of_a_step),
        ("lift of labels by the paper's rule", model::lift_of_a_step),
    ];
    for (name, change) in changes {
        let start = Instant::now();
        let verdict = change(rules, gpu, kernels, checks::LEEWAY)?;
        done(Check { name: name.to_owned(), verdict, seconds: start.elapsed().as_secs_f64() });
    }
    Ok(())
}
