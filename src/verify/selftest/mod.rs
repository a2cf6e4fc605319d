//! Compares the device with the reference: `labelgs selftest` runs these checks, and the tests use them.

pub mod antialias;
mod checks;
pub mod compare;
mod exposure;
pub mod fixture;
pub mod judge;
pub mod model;
pub mod moments;
pub mod order;
pub mod pose;
pub mod relocation;
pub mod scenes;
mod training;
pub mod update;

use crate::engine::EngineSize;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::reference::Rules;
use checks::FinishedStep;
use compare::{Summary, Tolerance, Verdict};
use fixture::{Fixture, readable};
use scenes::{Scene, population, scene_of};
use std::sync::Arc;
use std::time::Instant;

/// Factor between the self-test's error bounds and those of the tests on lavapipe. Vulkan allows `exp2`, division,
/// square roots and similar functions several units in the last place; lavapipe's error is about one.
const ERROR_FACTOR: f64 = 8.0;

/// Compares a device's results with the reference under given rules.
pub type Judge = Box<dyn Fn(&Rules) -> Verdict>;

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

/// Runs every check on a device, and passes each to `done` when it is finished. An error is a failure of the device
/// itself, such as insufficient memory.
pub fn run(gpu: &Arc<Gpu>, done: impl FnMut(Check)) -> Result<()> {
    run_against(&Rules::default(), gpu, done)
}

/// Same as [`run`], against different rules, to prove that the checks can fail.
pub fn run_against(rules: &Rules, gpu: &Arc<Gpu>, mut done: impl FnMut(Check)) -> Result<()> {
    let kernels = KernelShape::for_device(gpu.capabilities());
    let other = KernelShape { texel: !kernels.texel, ..kernels };
    passes(rules, gpu, kernels, "", &mut done)?;
    passes(rules, gpu, other, if other.texel { ", texel reads" } else { ", storage reads" }, &mut done)?;
    changes(rules, gpu, kernels, &mut done)?;
    wholes(gpu, kernels, &mut done)
}

/// Reports checks as they finish.
struct CheckClock<F> {
    /// End of the previous check.
    last: Instant,
    done: F,
}

impl<F: FnMut(Check)> CheckClock<F> {
    fn new(done: F) -> Self {
        Self { last: Instant::now(), done }
    }

    fn ended(&mut self, name: String, verdict: Verdict) {
        (self.done)(Check { name, verdict, seconds: self.last.elapsed().as_secs_f64() });
        self.last = Instant::now();
    }
}

/// Runs the checks of a long list and of a training.
pub fn wholes(gpu: &Arc<Gpu>, kernels: KernelShape, done: impl FnMut(Check)) -> Result<()> {
    let mut clock = CheckClock::new(done);
    clock.ended("70,000 splats in a tile".to_owned(), checks::long_list(gpu, kernels)?);
    clock.ended("training twice, bit by bit".to_owned(), training::twice(gpu, kernels)?);
    Ok(())
}

/// Runs the checks of a step's passes with kernels of a shape. `suffix` is appended to their names.
pub fn passes(
    rules: &Rules,
    gpu: &Arc<Gpu>,
    kernels: KernelShape,
    suffix: &str,
    done: impl FnMut(Check),
) -> Result<()> {
    let mut clock = CheckClock::new(done);
    let mut step = FinishedStep::new(rules, gpu, kernels)?;
    type Pass = fn(&mut FinishedStep) -> Result<Verdict>;
    let passes: [(&str, Pass); 14] = [
        ("depth order", FinishedStep::order),
        ("projection", FinishedStep::projection),
        ("tile lists", FinishedStep::tiles),
        ("blend forward", FinishedStep::blend),
        ("photo loss and its gradient", FinishedStep::loss),
        ("votes", |step| step.votes(false)),
        ("votes of Gaussians alone", |step| step.votes(true)),
        ("label map", FinishedStep::label_map),
        ("blend backward", FinishedStep::blend_backward),
        ("disagreement of labels", FinishedStep::disagreement),
        ("weights of Gaussians", FinishedStep::weights),
        ("gradient of a step with labels", FinishedStep::gradient),
        ("the same step twice, bit by bit", FinishedStep::repeated),
        ("Adam", FinishedStep::adam),
    ];
    for (name, pass) in passes {
        let verdict = pass(&mut step)?;
        clock.ended(format!("{name}{suffix}"), verdict);
    }
    Ok(())
}

/// A device, and the shape of its kernels.
struct Rig<'a> {
    gpu: &'a Arc<Gpu>,
    kernels: KernelShape,
}

impl Rig<'_> {
    fn fixture(&self, scene: Scene) -> Result<Fixture> {
        Fixture::new(Arc::clone(self.gpu), scene, true, self.kernels, readable())
    }

    /// Makes a fixture with the shape's own update.
    fn own(&self, scene: Scene) -> Result<Fixture> {
        Fixture::with_room(Arc::clone(self.gpu), scene, true, (self.kernels, readable()), |room| room)
    }

    /// Makes a fixture with the update in one kernel, if the device supports it, and with full or packed moments.
    fn lazy(&self, scene: Scene, half: bool) -> Result<Option<Fixture>> {
        let Some(kernels) = self.kernels.with_lazy_updates(self.gpu.capabilities()) else { return Ok(None) };
        let with = |room: EngineSize| room.with_half_moments(half);
        Fixture::with_room(Arc::clone(self.gpu), scene, true, (kernels, readable()), with).map(Some)
    }
}

/// Runs the checks of passes that change the model.
pub fn changes(rules: &Rules, gpu: &Arc<Gpu>, kernels: KernelShape, done: impl FnMut(Check)) -> Result<()> {
    /// Checks a densification with Gaussians below and above each threshold.
    fn densified(rig: &Rig, splits_long: bool) -> Result<Judge> {
        let before = population(710, 500);
        let tolerance = Tolerance { absolute: 3.5e-7, relative: 3.5e-8 }.times(ERROR_FACTOR);
        model::densification(&mut rig.fixture(scene_of(&before))?, before, (600, splits_long), tolerance)
    }
    type Change = fn(&Rig) -> Result<Judge>;
    let changes: [(&str, Change); 14] = [
        ("update in one kernel", |rig| match rig.lazy(update::partly_frozen(104), false)? {
            Some(mut fused) => update::step(&mut fused, &mut rig.fixture(update::partly_frozen(104))?),
            None => Ok(Box::new(|_| Ok(Summary::default()))),
        }),
        ("late Gaussians", |rig| match rig.lazy(update::partly_frozen(105), false)? {
            Some(mut fixture) => update::late(&mut fixture),
            None => Ok(Box::new(|_| Ok(Summary::default()))),
        }),
        ("packed moments", |rig| match rig.lazy(moments::away(106), true)? {
            Some(mut fused) => moments::packed(&mut fused, Some(&mut rig.fixture(moments::away(106))?)),
            None => Ok(Box::new(|_| Ok(Summary::default()))),
        }),
        ("densification", |rig| densified(rig, false)),
        ("densification along the longest axis", |rig| densified(rig, true)),
        ("marks of fog", |rig| model::fog(&mut rig.fixture(model::large(63))?)),
        ("relocation", |rig| {
            let before = population(711, 200);
            relocation::relocation(&mut rig.fixture(scene_of(&before))?, before, 300, ERROR_FACTOR)
        }),
        ("random moves", relocation::random_moves),
        ("reset of opacities", |rig| {
            let before = population(120, 300);
            model::reset(&mut rig.fixture(scene_of(&before))?, before, ERROR_FACTOR)
        }),
        ("exposure of a photo", exposure::step),
        ("pose of a photo", |rig| pose::step(rig.gpu, rig.kernels)),
        ("antialiased splats and their gradient", |rig| {
            antialias::step(&mut rig.fixture(antialias::fine(93))?, ERROR_FACTOR)
        }),
        ("smallest sizes of Gaussians", |rig| antialias::sizes(|| rig.own(antialias::around(94)), ERROR_FACTOR)),
        ("lift of labels by the paper's rule", |rig| model::lift(&mut rig.fixture(model::dominant(131))?)),
    ];
    let (mut clock, rig) = (CheckClock::new(done), Rig { gpu, kernels });
    for (name, change) in changes {
        let judge = change(&rig)?;
        clock.ended(name.to_owned(), judge(rules));
    }
    Ok(())
}
