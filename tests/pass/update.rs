//! The update of a step in one kernel against the passes that it replaces, and Gaussians that are late.

use super::fixture::{Fixture, MOMENTS_1, MOMENTS_2, PARAMETER_PLANES, prove, readable};
use super::walks::{WALKERS, tall_scene};
use crate::reference::Row;
use crate::support::device;
use crate::support::device::Turn;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::pass::{KernelShape, Update};
use labelgs::run::StrategyKind;
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::relocation::set_strategy;
use labelgs::verify::selftest::update::{drifted, late, many, partly_frozen, step};
use labelgs::verify::selftest::{antialias, fixture, pose};

const COUNT: usize = 90;
const FROZEN: usize = 10;

/// The state after each step.
struct After {
    planes: [Vec<Row>; 3],
    stats: Vec<[f32; 2]>,
    visible: u32,
    nonfinite: u32,
    /// Gaussians that have no splat.
    unseen: usize,
}

/// What steps do besides.
#[derive(Clone, Copy, Debug, Default)]
struct Form {
    labels: bool,
    antialiased: bool,
    texel: bool,
    /// The strategy whose passes they have: loss terms and random moves of mcmc, and smallest sizes if antialiased.
    strategy: Option<StrategyKind>,
}

/// Steps whose camera looks at either half of the scene in turn, and nearer from time to time. All catch up after each
/// step, or only after the last one.
fn steps(update: Update, form: Form, count: u32, catches_up: bool) -> Option<Vec<After>> {
    let turn = device()?;
    let shape = Shape { gaussians: COUNT, ..Shape::default() };
    // Faint ones move.
    let shape = if form.strategy.is_some() { Shape { opacities: (-6.0, 3.0), ..shape } } else { shape };
    let mut scene = Scene { frozen: FROZEN as u32, ..scene(103, &shape) };
    scene.gaussians.antialiased = form.antialiased;
    let kernels = KernelShape { texel: form.texel, ..KernelShape::for_device(turn.capabilities()) };
    let kernels = KernelShape { update, ..kernels.with_lazy_updates(turn.capabilities())? };
    let mut fixture = Fixture::with_update(turn, scene, form.labels, kernels);
    fixture.input.update = true;
    let mut passes = 0;
    if let Some(kind) = form.strategy {
        (fixture.config.antialias, fixture.config.position_lr_init) = (form.antialiased, 2e-5);
        passes = set_strategy(&mut fixture, kind);
    }
    let (cx, depth) = (fixture.scene.camera.cx, fixture.scene.camera.translation.z);
    let mut all = Vec::new();
    for step in 1..=count {
        (fixture.input.step, fixture.input.updates) = (step, step);
        // 30 px to a side: most Gaussians are outside.
        fixture.scene.camera.cx = if step % 3 == 0 { cx + 40.0 } else { cx - 40.0 };
        // Smallest sizes fall in nearer views.
        let nearer = if form.strategy.is_some() && step % 4 == 0 { 0.1 * f64::from(step) } else { 0.0 };
        fixture.scene.camera.translation.z = depth - nearer;
        let counters = fixture.train_with(passes).expect("the step runs").counters;
        let seen = fixture.get::<u32>(Buf::SPLAT_FROM_GAUSSIAN, COUNT);
        if catches_up || step == count {
            fixture.engine.catch_up().expect("it catches up");
        }
        let trained = COUNT - FROZEN;
        let planes =
            [fixture.rows(PARAMETER_PLANES, COUNT), fixture.rows(MOMENTS_1, trained), fixture.rows(MOMENTS_2, trained)];
        all.push(After {
            planes,
            stats: fixture.get(Buf::DENSIFY_STATS, trained),
            visible: counters.visible_count,
            nonfinite: counters.nonfinite_count,
            unseen: seen.iter().filter(|&&splat| splat == u32::MAX).count(),
        });
    }
    Some(all)
}

/// Largest differences of parameters, relative to the largest step so far, and of moments, relative to the largest of
/// their Gaussian.
fn differences(a: &After, b: &After) -> [f64; 3] {
    let most = |k: usize, scale: &dyn Fn(&Row) -> f64| {
        let of = |(a, b): (&Row, &Row)| {
            let scale = scale(b);
            a.floats().iter().zip(b.floats()).map(|(a, b)| (a - b).abs() / scale).fold(0.0, f64::max)
        };
        a.planes[k].iter().zip(&b.planes[k]).map(of).fold(0.0, f64::max)
    };
    let largest = |row: &Row| row.floats().iter().fold(1e-30, |most: f64, of| most.max(of.abs()));
    [most(0, &|_| 1.0), most(1, &largest), most(2, &largest)]
}

fn lazy(turn: Turn, seed: u64) -> Fixture {
    let shape =
        KernelShape::for_device(turn.capabilities()).with_lazy_updates(turn.capabilities()).expect("few buffers");
    Fixture::with_update(turn, partly_frozen(seed), true, shape)
}

#[test]
fn an_update_in_one_kernel_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let gpu = turn.gpu();
    let shape = KernelShape::for_device(turn.capabilities());
    let mut fused = lazy(turn, 104);
    let mut split = fixture::Fixture::new(gpu, partly_frozen(104), true, shape, readable()).expect("it starts");
    let judge = step(&mut fused, &mut split).expect("it runs");
    prove("update", &["adam_beta1", "adam_beta2"], judge);
}

#[test]
fn late_gaussians_equal_their_mirror() {
    let Some(turn) = device() else { return };
    let judge = late(&mut lazy(turn, 105)).expect("it runs");
    prove("late Gaussians", &["adam_beta1", "adam_beta2"], judge);
}

#[test]
fn one_kernel_updates_as_the_passes_do() {
    let form = Form::default();
    for (form, catches_up) in [
        (Form { texel: true, ..form }, true),
        (form, true),
        // With labels, lavapipe has too few bindings without texel reads.
        (Form { labels: true, texel: true, ..form }, true),
        (Form { antialiased: true, texel: true, ..form }, true),
        (Form { strategy: Some(StrategyKind::Mcmc), ..form }, false),
        (Form { strategy: Some(StrategyKind::Adc), antialiased: true, ..form }, false),
        (Form { strategy: Some(StrategyKind::Mcmc), antialiased: true, labels: true, texel: true }, false),
    ] {
        let Some(split) = steps(Update::Split, form, 7, false) else { return };
        let fused = steps(Update::Lazy, form, 7, catches_up).expect("a device");
        for (step, (a, b)) in fused.iter().zip(&split).enumerate() {
            let found = differences(a, b);
            println!("{form:?}, step {}: {found:?}, {} of {COUNT} unseen", step + 1, a.unseen);
        }
        for (step, (a, b)) in fused.iter().zip(&split).enumerate() {
            assert_eq!((a.visible, a.nonfinite, a.unseen), (b.visible, b.nonfinite, b.unseen), "step {step}");
            let [parameters, first, second] = differences(a, b);
            // Random moves of a tenth depend on 100 times the opacity, and so on 100 times its rounding errors; 5.7e-6
            // seen after seven of them.
            let bound = if form.strategy == Some(StrategyKind::Mcmc) { 1e-5 } else { 2e-6 };
            if catches_up || step == 6 {
                assert!(parameters < bound && first < 1e-5 && second < 1e-5, "{step}: {parameters} {first} {second}");
            }
            assert!(a.unseen > 20 && a.visible > 10, "{} unseen, {} visible", a.unseen, a.visible);
            for (a, b) in a.stats.iter().zip(&b.stats) {
                assert!((a[0] - b[0]).abs() <= 1e-5 * b[0].abs() && a[1] == b[1], "{a:?} {b:?}");
            }
        }
        let late = fused[5].planes[0].iter().zip(&split[5].planes[0]).filter(|(a, b)| a != b).count();
        assert!(catches_up || late > 3, "{late} are late");
    }
}

#[test]
fn late_gaussians_catch_up_to_those_of_every_step() {
    let Some(lazy) = steps(Update::Lazy, Form::default(), 12, false) else { return };
    let every = steps(Update::Lazy, Form::default(), 12, true).expect("a device");
    let (mut late, mut last) = (0, [0.0; 3]);
    for (a, b) in lazy.iter().zip(&every) {
        last = differences(a, b);
        late += usize::from(last[0] > 1e-4);
        println!("{last:?}");
        assert_eq!((a.visible, a.unseen), (b.visible, b.unseen));
    }
    assert!(late > 3, "Gaussians were late in {late} steps");
    assert!(last[0] < 2e-6 && last[1] < 1e-5 && last[2] < 1e-5, "{last:?}");
}

/// Late Gaussians that have drifted as far as Adam can move them are listed, and marked as fog, as after catching up.
#[test]
fn drifted_gaussians_are_listed_as_after_catching_up() {
    let listed = |drifts: bool, catches_up: bool| {
        let turn = device()?;
        let shape =
            KernelShape::for_device(turn.capabilities()).with_lazy_updates(turn.capabilities()).expect("few buffers");
        let mut fixture = Fixture::with_update(turn, many(106), false, shape);
        Some(drifted(&mut fixture, drifts, catches_up).expect("it runs"))
    };
    let Some(still) = listed(false, true) else { return };
    let late = listed(true, false).expect("a device");
    assert_eq!(late, listed(true, true).expect("a device"));
    for (still, late) in still.iter().zip(&late) {
        let changed = |was: bool| still.iter().zip(late).filter(|&(&a, &b)| a == was && b != was).count();
        assert!(changed(true) > 5 && changed(false) > 5, "{} out, {} in", changed(true), changed(false));
    }
}

#[test]
fn gradients_of_a_pose_and_smallest_sizes_of_one_kernel_equal_their_mirrors() {
    let Some(turn) = device() else { return };
    let shape = KernelShape::for_device(turn.capabilities());
    let lazy = shape.with_lazy_updates(turn.capabilities()).expect("few buffers");
    prove("pose", &["sh_c1"], pose::step(&turn.gpu(), lazy).expect("it runs"));
    let rig = || {
        let scene = antialias::around(96);
        fixture::Fixture::with_room(turn.gpu(), scene, false, (lazy, readable()), |room| room)
    };
    prove("smooth", &["finest", "smooth_margin"], antialias::sizes(rig, 1.0).expect("it runs"));
}

/// A splat with more records than a workgroup has invocations is summed by all of them, in the order of `gather`: the
/// same bits of the statistic.
#[test]
fn large_splats_are_summed_by_a_workgroup() {
    let run = |update| {
        let turn = device()?;
        let shape = KernelShape { group_walks: true, update, ..KernelShape::for_device(turn.capabilities()) };
        let scene = tall_scene();
        let count = scene.gaussians.len();
        let mut fixture = Fixture::with_update(turn, scene, true, shape);
        fixture.config.sh_degree = 0;
        fixture.input.update = true;
        let visible = fixture.train().counters.visible_count as usize;
        let touched = fixture.get::<u32>(Buf::TILES_TOUCHED, visible);
        let large = touched.iter().filter(|&&records| records > WALKERS).count();
        assert!(large > 3 && large + 3 < visible, "{large} of {visible} are large");
        Some((fixture.get::<[u32; 2]>(Buf::DENSIFY_STATS, count), fixture.rows(MOMENTS_1, count)))
    };
    let Some((stats, moments)) = run(Update::Split) else { return };
    let (found, found_moments) = run(Update::Lazy).expect("a device");
    assert!(stats.iter().filter(|stat| stat[1] != 0).count() > 10 && found == stats);
    for (a, b) in found_moments.iter().zip(&moments) {
        let scale = b.floats().iter().fold(1e-30, |most: f64, of| most.max(of.abs()));
        assert!(a.floats().iter().zip(b.floats()).all(|(a, b)| (a - b).abs() < 1e-5 * scale), "{a:?} {b:?}");
    }
}
