//! Scenes at the edge: nothing to see, one Gaussian, one pixel, no labels.

use crate::pass::fixture::{Fixture, readable};
use crate::reference::Rules;
use crate::reference::blend::blend_forward;
use crate::support::compare::{Tolerance, check, close};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::render::{RenderOptions, render};
use labelgs::scene::Gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::{Buf, Work};

fn shape(gaussians: usize, width: u32, height: u32) -> Shape {
    Shape { gaussians, width, height, opacities: (0.0, 4.0), ..Shape::default() }
}

/// Sizes that are no multiple of a tile, and smaller than one.
#[test]
fn pictures_of_any_size_equal_the_mirror() {
    for (width, height) in [(13, 12), (33, 12), (12, 67)] {
        let Some(turn) = device() else { return };
        let mut fixture = Fixture::new(turn, scene(211, &shape(30, width, height)), true);
        fixture.render();
        let (splats, size, background) = (fixture.splats(), fixture.size(), fixture.scene.target.background);
        let image = fixture.get::<[f32; 4]>(Buf::IMAGE, size.0 * size.1);
        let expected = blend_forward(&Rules::default(), &splats, size, background);
        let actual: Vec<f64> = image.iter().flat_map(|p| [p[0], p[1], p[2]].map(f64::from)).collect();
        check(
            "picture",
            close(&actual, expected.colours().as_flattened(), Tolerance { absolute: 1e-6, relative: 0.0 }),
        );
        fixture.train();
    }
}

#[test]
fn a_picture_of_one_pixel_trains() {
    let Some(turn) = device() else { return };
    let mut s = scene(212, &shape(5, 12, 12));
    s.camera = s.camera.resized(1, 1);
    s.target.photo.size = (1, 1);
    s.target.photo.colours.truncate(1);
    s.target.photo.valid = vec![true];
    s.target.label_map = vec![1];
    s.target.slots.truncate(1);
    let mut fixture = Fixture::new(turn, s, true);
    let report = fixture.train();
    assert!(report.counters.loss_l1.is_finite() && report.counters.nonfinite_count == 0);
}

#[test]
fn one_gaussian_trains() {
    let Some(turn) = device() else { return };
    let mut s = scene(213, &shape(1, 30, 20));
    s.gaussians.means = vec![[0.0; 3]];
    let mut fixture = Fixture::new(turn, s, true);
    fixture.input.update = true;
    let report = fixture.train();
    assert_eq!(report.counters.visible_count, 1);
    assert!(fixture.gradient_rows()[0].mean.iter().any(|v| *v != 0.0));
}

/// No gradient, no update, and the picture is the background.
#[test]
fn without_visible_gaussians_a_step_changes_nothing() {
    let Some(turn) = device() else { return };
    let mut s = scene(214, &shape(20, 30, 20));
    s.gaussians.means.iter_mut().for_each(|mean| mean[2] = -50.0);
    let background = s.target.background.map(|v| v as f32);
    let mut fixture = Fixture::new(turn, s, true);
    fixture.input.update = true;
    let before = fixture.get::<u32>(Buf::MEANS, 80);
    let report = fixture.train();
    assert_eq!((report.counters.visible_count, report.counters.instance_count), (0, 0));
    let [r, g, b] = background;
    assert!(fixture.get::<[f32; 4]>(Buf::IMAGE, 600).iter().all(|pixel| *pixel == [r, g, b, 1.0]));
    assert_eq!(fixture.get::<u32>(Buf::MEANS, 80), before);
}

/// A Gaussian with NaN, or with values that overflow in the projection, affects no other Gaussian and no pixel.
#[test]
fn nan_gaussians_do_not_spread() {
    let Some(turn) = device() else { return };
    let mut s = scene(215, &shape(20, 30, 20));
    s.gaussians.means[3] = [f32::NAN; 3];
    s.gaussians.scales[5] = [60.0; 3];
    s.gaussians.scales[6] = [f32::INFINITY; 3];
    s.gaussians.opacities[7] = f32::NAN;
    s.gaussians.sh0[8] = [f32::NAN; 3];
    s.gaussians.quats[9] = [0.0; 4];
    s.gaussians.means[10] = [1e30, 0.0, 1e30];
    let mut fixture = Fixture::new(turn, s, true);
    fixture.input.update = true;
    let report = fixture.train();
    assert!(fixture.get::<f32>(Buf::IMAGE, 2400).iter().all(|v| v.is_finite()));
    assert!(report.counters.loss_l1.is_finite() && report.counters.loss_label.is_finite());
    for (index, row) in fixture.gradient_rows().iter().enumerate() {
        assert!(row.floats().iter().all(|v| v.is_finite()), "gradient of Gaussian {index}");
    }
}

#[test]
fn a_model_without_gaussians_renders_the_background() {
    let Some(turn) = device() else { return };
    let camera = scene(216, &shape(1, 30, 20)).camera;
    let room = EngineSize::new(0, (30, 20));
    let mut engine = Engine::new(turn.gpu(), room, readable()).expect("the engine starts");
    engine.upload_model(&Gaussians::default()).expect("nothing to upload");
    let options = RenderOptions { background: [0.5, 0.25, 0.0], ..RenderOptions::default() };
    let rendered = render(&mut engine, &camera, &options).expect("a picture");
    assert!(rendered.rgb.iter().all(|pixel| *pixel == [0.5, 0.25, 0.0]));
    assert!(rendered.top_id.iter().all(|&id| id == -1) && rendered.alpha.iter().all(|&alpha| alpha == 0.0));
    assert!(engine.download_model().expect("a model").is_empty());
}

const LABEL_BUFFERS: [&str; 11] = [
    "labels",
    "label_keys",
    "view_labels",
    "layer_from_label",
    "label_from_layer",
    "layer_occluders",
    "old_labels",
    "layer_state",
    "label_map",
    "label_weights",
    "label_tables",
];

#[test]
fn a_scene_without_labels_has_no_label_buffers_or_passes() {
    let Some(turn) = device() else { return };
    let s = scene(217, &shape(40, 30, 20));
    let mut fixture = Fixture::new(turn, s, false);
    fixture.input.update = true;
    fixture.train();
    let key = fixture.key();
    let id = fixture.engine.list(key).expect("the list of the step");
    let memory = fixture.engine.raw().memory();
    let of_labels: u64 = memory.iter().filter(|(name, _)| LABEL_BUFFERS.contains(&name.as_str())).map(|(_, n)| n).sum();
    assert_eq!(of_labels, 0, "{memory:?}");
    let plan = fixture.engine.raw().plan(id).expect("a plan");
    for work in &plan.list.work {
        let Work::Pass(pass) = work else { continue };
        let named = ["labels", "lift", "layer"].iter().any(|word| pass.shader.name.contains(word));
        assert!(!named, "{} is in the list", pass.shader.name);
        for buf in &pass.buffers {
            assert!(!LABEL_BUFFERS.contains(&plan.table[buf.index()].name), "{} binds labels", pass.shader.name);
        }
    }
    // A render allocates no buffers of training.
    let labels = Some(LabelSize { max_label: 3, layers: 2, vote_columns: 0 });
    let size = |trained, labels| EngineSize { trained, labels, ..EngineSize::new(1000, (64, 48)) };
    let total = |size: &EngineSize| {
        Engine::predict(fixture.engine.gpu(), size, SchedulerOptions::default()).expect("it fits").total
    };
    assert!(
        total(&size(false, None)) < total(&size(true, None)) && total(&size(true, None)) < total(&size(true, labels))
    );
}
