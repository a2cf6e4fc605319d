//! Lists of splats that are longer than one dispatch may walk.

use crate::pass::fixture::{Fixture, readable};
use crate::reference::{blend, lift, model::Model, project, rules::Rules};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass::KernelShape;
use labelgs::render::{RenderOptions, render};
use labelgs::run::TrainConfig;
use labelgs::scene::{Camera, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::train::Trainer;
use labelgs::train::setup::TrainerOptions;

/// Tiny, faint Gaussians in front of one 8 x 8 tile.
fn crowd(count: usize) -> (Gaussians, Camera) {
    let camera = Camera {
        rotation: glam::DMat3::IDENTITY,
        translation: glam::DVec3::ZERO,
        fx: 64.0,
        fy: 64.0,
        cx: 4.0,
        cy: 4.0,
        width: 8,
        height: 8,
    };
    let part = |i: usize, a: usize| (i * a % 9973) as f32 / 9973.0;
    let gaussians = Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: (0..count)
            .map(|i| {
                let z = 2.0 + i as f32 * 1e-4;
                [(part(i, 31) - 0.5) * 0.12 * z, (part(i, 57) - 0.5) * 0.12 * z, z]
            })
            .collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: vec![[-9.0; 3]; count],
        // just above the smallest visible opacity
        opacities: vec![-5.0; count],
        sh0: (0..count).map(|i| [part(i, 7) * 2.0, part(i, 11), part(i, 13)]).collect(),
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: None,
        label_confidence: None,
    };
    (gaussians, camera)
}

#[test]
fn sixty_thousand_gaussians_in_one_tile_equal_the_mirror() {
    let Some(turn) = device() else { return };
    let gpu = turn.gpu();
    let (mut model, camera) = crowd(60_000);
    // More labels than one walk sums; the last to appear have twice the weight of the others.
    let label = |(i, mean): (u32, &[f32; 3])| if i % 7 < 5 { i % 7 } else { 5 + u32::from(mean[0] < 0.0) };
    let labels: Vec<u32> = (0..).zip(&model.means).map(label).collect();
    model.labels = Some(labels.clone());
    let room = EngineSize::new(60_000, (8, 8));
    let mut engine = Engine::new(gpu, room, SchedulerOptions::default()).expect("room");
    engine.upload_model(&model).expect("model");
    let rendered = render(&mut engine, &camera, &RenderOptions::default()).expect("render");
    assert!(engine.capacity().segments > 1, "the list fits one segment; the test shows nothing");
    let rules = Rules::default();
    let splats: Vec<_> = project::project_all(&rules, &camera, &Model::from_gaussians(&model))
        .into_iter()
        .map(|projection| projection.splat)
        .collect();
    let expected = blend::blend_forward(&rules, &splats, (8, 8), [0.0; 3]);
    for (pixel, (found, expected)) in rendered.rgb.iter().zip(&expected.pixels).enumerate() {
        for channel in 0..3 {
            // About 900 splats a pixel, each rounded to 6e-8 of a colour near 1 (worst seen 4e-5: splats at the cut).
            let difference = (f64::from(found[channel]) - expected.colour[channel]).abs();
            assert!(
                difference < 2e-4,
                "pixel {pixel} channel {channel}: {} {}",
                found[channel],
                expected.colour[channel]
            );
        }
        assert!(expected.count > 300, "pixel {pixel} has {} splats; the crowd is too thin", expected.count);
    }
    let expected = lift::label_map(&rules, &splats, &labels, (8, 8));
    let expected: Vec<u32> = expected.iter().map(|pixel| pixel.label).collect();
    let found = rendered.labels;
    assert!(found == expected && [5, 6].iter().all(|label| found.contains(label)), "{found:?} for {expected:?}");
}

/// A short training whose lists are walked in many segments equals one whose lists are walked at once, bit for bit.
#[test]
fn segments_change_no_bit() {
    let Some(turn) = device() else { return };
    let gpu = turn.gpu();
    let options = labelgs::synth::SynthOptions {
        width: 64,
        height: 48,
        views: 6,
        points: 400,
        preset: labelgs::synth::Preset::Simple,
        ..Default::default()
    };
    let dataset = labelgs::synth::dataset(&options, 0);
    let start = labelgs::scenes::initial_gaussians(&dataset, 0, 400).expect("points");
    let config = TrainConfig { iterations: 20, label_from: Some(5), ..TrainConfig::default() };
    let run = |segment_length: u32| {
        let shape = KernelShape { segment_length, ..KernelShape::for_device(gpu.capabilities()) };
        let options = TrainerOptions { shape: Some(shape), ..TrainerOptions::default() };
        let mut trainer = Trainer::new(gpu.clone(), config.clone(), &dataset, &start, options).expect("trainer");
        for _ in 0..config.iterations {
            trainer.step().expect("step");
        }
        let model = trainer.model().expect("model");
        (model, trainer.engine_mut().capacity().segments)
    };
    let ((whole, one), (parts, many)) = (run(40_960), run(64));
    assert!(one == 1 && many > 2, "{one} and {many} segments");
    assert_eq!(whole, parts);
}

/// Pictures narrower than a tile have more tiles than their pixels divided by a tile's; each tile has its segments.
#[test]
fn segments_of_narrow_pictures_fit_their_buffer() {
    for (width, height) in [(3, 200), (1, 150), (200, 3)] {
        let Some(turn) = device() else { return };
        let shape = KernelShape { segment_length: 64, ..KernelShape::for_device(turn.capabilities()) };
        let made = scene(61, &Shape { gaussians: 400, width, height, scales: (0.3, 1.5), ..Shape::default() });
        // Guards behind the buffers are checked after each run.
        let mut fixture = Fixture::with_options(turn, made, true, shape, readable());
        fixture.train();
        let segments = fixture.engine.capacity().segments;
        assert!(segments > 1, "{width} x {height}: one segment shows nothing");
    }
}
