//! The label with the largest sum of weights in each pixel, for any number of labels and walks.

use super::fixture::{Fixture, prove, readable};
use super::labels::{MIDDLE, on_a_ray};
use crate::reference::Rules;
use crate::reference::lift::label_map as mirror;
use crate::support::compare::Tolerance;
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::engine::Engine;
use labelgs::engine::run::ListKey;
use labelgs::pass::KernelShape;
use labelgs::render::{Parts, RenderOptions, label_map, render};
use labelgs::scene::Gaussians;
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::judge;

/// Faint Gaussians of `objects` labels and none, many of them in each tile and pixel.
fn haze(objects: u32) -> Scene {
    let shape = Shape { scales: (0.1, 0.5), opacities: (-3.0, 1.0), objects, ..Shape::default() };
    scene(151, &Shape { gaussians: 120, width: 45, height: 37, ..shape })
}

/// Pixels with a smaller distance of a decision to its opposite may go either way.
const DECISION_MARGIN: f64 = 2e-5;

/// The map of a scene, with kernels of a shape, and the numbers of tiles that are undecided after one and after `walks`
/// walks.
fn mapped(
    objects: u32,
    walks: u32,
    shape: impl Fn(KernelShape) -> KernelShape,
) -> Option<(Fixture, Vec<u16>, [u32; 2])> {
    let turn = device()?;
    let shape = shape(KernelShape::for_device(turn.capabilities()));
    let mut fixture = Fixture::with_options(turn, haze(objects), true, shape, readable());
    let undecided = [1, walks].map(|walks| fixture.train_as(ListKey::LabelMap(walks)).counters.undecided_tiles);
    println!("{objects} objects, {shape:?}: undecided tiles {undecided:?}");
    let (camera, near) = (fixture.scene.camera.clone(), fixture.config.near);
    let map = label_map(&mut fixture.engine, &camera, near).expect("a map");
    Some((fixture, map.ids, undecided))
}

#[test]
fn label_maps_of_any_number_of_walks_equal_the_mirror() {
    // Four labels, eight, and more than can be walked at all.
    for (objects, walks) in [(3, 1), (7, 2), (40, 8)] {
        let Some((mut fixture, ids, [first, last])) = mapped(objects, walks, |shape| shape) else { return };
        assert!((first > 0) == (walks > 1) && last == 0, "{objects} objects: {first}, then {last} tiles undecided");
        let (splats, size, labels) = (fixture.splats(), fixture.size(), fixture.model().labels);
        let weights = fixture.get::<f32>(Buf::LABEL_WEIGHTS, ids.len());
        let most = mirror(&Rules::default(), &splats, &labels, size).iter().map(|pixel| pixel.labels).max();
        assert!(most > Some(4 * (walks as usize - 1)).min(Some(20)), "only {most:?} labels in a pixel");
        // Sums of up to 1 of some twenty terms, each rounded to 6e-8.
        let tolerance = Tolerance { absolute: 1e-6, relative: 0.0 };
        prove("label map", &["alpha_min", "label_sums"], |rules| {
            judge::label_map((&ids, &weights), &mirror(rules, &splats, &labels, size), (tolerance, DECISION_MARGIN))
        });
    }
}

#[test]
fn label_maps_are_the_same_with_segments_texel_reads_and_emulated_subgroups() {
    let ids = |shape: &dyn Fn(KernelShape) -> KernelShape| Some(mapped(40, 8, shape)?.1);
    let Some(whole) = ids(&|shape| shape) else { return };
    let segmented = |shape| KernelShape { segment_length: 16, ..shape };
    let other = |shape: KernelShape| KernelShape { texel: !shape.texel, ..shape };
    assert!(ids(&segmented).as_ref() == Some(&whole) && ids(&other).as_ref() == Some(&whole));
    for size in [4, 32] {
        let emulated = |own: KernelShape| KernelShape { emulated: true, ..KernelShape::new(size, own.texel) };
        let both = |own: KernelShape| segmented(emulated(own));
        assert!(ids(&both).as_ref() == Some(&whole), "emulated subgroups of {size}");
    }
}

/// One Gaussian has the largest weight, and those behind it together a larger one.
#[test]
fn many_faint_gaussians_outweigh_a_main_one() {
    for (labels, expected) in [([1, 2, 2, 2], 2), ([1, 0, 0, 0], 0), ([0, 2, 2, 2], 2), ([3, 2, 1, 0], 3)] {
        let Some(turn) = device() else { return };
        // Weights 0.3, 0.21, 0.147, 0.1029.
        let mut s = on_a_ray(&[0.3; 4]);
        s.gaussians.labels = Some(labels.to_vec());
        let mut fixture = Fixture::new(turn, s, true);
        let camera = fixture.scene.camera.clone();
        let options = RenderOptions::new(fixture.config.near, Parts::ALL);
        let rendered = render(&mut fixture.engine, &camera, &options).expect("a picture");
        assert_eq!(rendered.labels[MIDDLE], expected, "{labels:?}");
        assert_eq!(rendered.main_label_map(&labels).expect("main Gaussians").ids[MIDDLE], labels[0] as u16);
        assert_eq!(rendered.label_map().expect("labels"), label_map(&mut fixture.engine, &camera, 0.2).expect("a map"));
    }
}

#[test]
fn a_model_without_labels_has_a_map_of_zeros_and_no_memory_for_it() {
    let Some(turn) = device() else { return };
    let s = haze(3);
    let size = (s.camera.width, s.camera.height);
    let bare = Gaussians { labels: None, ..s.gaussians.clone() };
    let mut engine = Engine::for_model(turn.gpu(), &bare, [size]).expect("an engine");
    let rendered = render(&mut engine, &s.camera, &RenderOptions::new(0.2, Parts::ALL)).expect("a picture");
    assert!(rendered.labels.len() == rendered.rgb.len() && rendered.labels.iter().all(|&label| label == 0));
    let memory = |engine: &Engine| -> u64 {
        let rows = engine.raw().memory();
        rows.iter().filter(|(name, _)| name.starts_with("label")).map(|(_, bytes)| bytes).sum()
    };
    assert_eq!(memory(&engine), 0);
    // A model with labels brings its memory along.
    engine.upload_model(&s.gaussians).expect("room");
    let options = RenderOptions::new(0.2, Parts::ALL);
    let grown = render(&mut engine, &s.camera, &options).expect("a picture");
    assert!(memory(&engine) > 0 && grown.labels.iter().any(|&label| label > 0) && grown.rgb == rendered.rgb);
    let mut made = Engine::for_model(turn.gpu(), &s.gaussians, [size]).expect("an engine");
    assert!(render(&mut made, &s.camera, &options).expect("a picture") == grown);
}
