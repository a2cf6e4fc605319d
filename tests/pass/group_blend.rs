//! Blends by workgroups: what may not change a bit.

use super::fixture::{BLENDS, Fixture};
use crate::reference::Model;
use crate::support::device;
use crate::support::scenes::{Scene, Shape, dot, plain_camera, scene};
use labelgs::pass::{GroupBlend, KernelShape};
use labelgs::run::LabelRule;
use labelgs::scene::Gaussians;
use labelgs::scheduler::plan::Buf;

/// What a step has besides its photo.
#[derive(Clone, Copy, Debug, PartialEq)]
enum With {
    Nothing,
    Depths,
    Disagreement,
    Layers,
    Lift,
}

/// What a step leaves, as bits.
#[derive(Debug, PartialEq)]
struct Step {
    picture: Vec<u32>,
    last: Vec<u32>,
    gradients: Vec<u32>,
    losses: [u32; 3],
    walked: u64,
}

/// A step, with the chunks of lists that were walked in parts, and the lists that came next.
fn step(of: Scene, form: GroupBlend, with: With) -> Option<(Step, [u32; 2])> {
    let turn = device()?;
    let shape = KernelShape::for_device(turn.capabilities()).with_group_blend_of(form);
    let mut fixture =
        Fixture::with_shape(turn, of, matches!(with, With::Disagreement | With::Layers | With::Lift), shape);
    if with != With::Lift {
        fixture.config.label_rule = LabelRule::Votes;
    }
    if with == With::Disagreement {
        fixture.input.layers.clear();
    }
    let pixels = fixture.pixels();
    if with == With::Depths {
        (fixture.config.iterations, fixture.config.label_from) = (1_000_000_000, None);
        fixture.config.depth_weight = Some(1e5);
        fixture.view.depths = (0..pixels).map(|at| [0.0, 0.1, 0.25, 0.5][at % 4]).collect();
    }
    let counters = fixture.train().counters;
    let splats = counters.visible_count as usize;
    let found = Step {
        picture: fixture.get(Buf::IMAGE, 4 * pixels),
        last: fixture.get(Buf::LAST, pixels),
        gradients: fixture.get(Buf::V_SPLATS, 12 * splats),
        losses: [counters.loss_l1, counters.loss_ssim, counters.loss_label].map(f32::to_bits),
        walked: u64::from(counters.walked_first) + u64::from(counters.walked_second),
    };
    Some((found, [counters.long_chunk_count, counters.first_list_count]))
}

/// Lists of more than 64 splats, in which some pixels stop.
fn crowded() -> Scene {
    let crowded = Shape { gaussians: 200, width: 29, height: 19, opacities: (-4.0, 9.0), ..Shape::default() };
    scene(56, &crowded)
}

fn short() -> GroupBlend {
    let [_, Some(short)] = BLENDS else { panic!("a form by workgroups") };
    short
}

#[test]
fn neither_skipping_nor_the_order_of_workgroups_changes_a_bit() {
    for with in [With::Layers, With::Disagreement] {
        let Some((of, [parts, _])) = step(crowded(), short(), with) else { return };
        assert!(parts > 8, "{parts} chunks are walked alone");
        let (unskipped, _) = step(crowded(), GroupBlend { culls: false, ..short() }, with).expect("a device");
        assert!(of == unskipped, "{with:?}: skipping changes bits");
        let (turned, _) = step(crowded(), GroupBlend { turned: true, ..short() }, with).expect("a device");
        assert!(of == turned, "{with:?}: order changes bits");
    }
}

#[test]
fn a_list_walked_in_parts_has_the_bits_of_one_walked_whole() {
    for with in [With::Nothing, With::Depths, With::Disagreement, With::Layers, With::Lift] {
        let Some((parts, [count, _])) = step(crowded(), short(), with) else { return };
        let whole = GroupBlend { long_list: u32::MAX, ..short() };
        let (whole, [none, _]) = step(crowded(), whole, with).expect("a device");
        // A lift needs the main splat of a pixel, which parts do not know.
        assert_eq!((count > 8, none), (with != With::Lift, 0), "{with:?}: {count} chunks are walked alone");
        assert!(parts == whole, "{with:?}: parts change bits");
    }
}

/// Splats that halve what is behind them, all over the picture, after `faint` ones that take a hundredth.
fn walls(faint: usize, count: usize) -> Scene {
    let camera = plain_camera(8, 8);
    let wall = |i: usize| {
        let opacity = if i < faint { 0.01 } else { 0.5 };
        dot(&camera, [3.5, 4.5], 2.0 + 0.125 * i as f64, 400.0, opacity)
    };
    let model = Model { rows: (0..count).map(wall).collect(), ..Model::default() };
    let template = scene(1, &Shape { gaussians: 1, width: 8, height: 8, objects: 1, ..Shape::default() });
    Scene { camera, gaussians: Gaussians { labels: Some(vec![0; count]), ..model.gaussians() }, ..template }
}

#[test]
fn lists_that_end_and_pixels_that_stop_at_the_border_of_a_chunk_have_the_same_bits() {
    let parts = GroupBlend { chunk_length: 4, long_list: 4, ..GroupBlend::DEFAULT };
    for faint in [2, 3] {
        for count in [15, 16, 17, 20] {
            let Some((of, [chunks, _])) = step(walls(faint, count), parts, With::Nothing) else { return };
            assert!(chunks >= count.div_ceil(4) as u32, "{chunks} chunks of {count} splats");
            // 2^-13 is the least power above 1e-4, and faint ones do not take it below.
            let last = count.min(13 + faint) as u32;
            assert!(of.last.iter().all(|&at| at == last), "{faint} faint of {count}: {:?} for {last}", of.last);
            let whole = GroupBlend { long_list: u32::MAX, ..parts };
            let (whole, _) = step(walls(faint, count), whole, With::Nothing).expect("a device");
            assert!(of == whole, "{faint} faint of {count}: parts change bits");
            let (turned, _) =
                step(walls(faint, count), GroupBlend { turned: true, ..parts }, With::Nothing).expect("a device");
            assert!(of == turned, "{faint} faint of {count}: order changes bits");
        }
    }
}

#[test]
fn to_come_first_changes_no_bit() {
    let camera = plain_camera(40, 16);
    let at = |i: usize| if i < 40 { [19.5, 3.5] } else { [i as f64 - 39.5, 11.5] };
    let rows = (0..80).map(|i| dot(&camera, at(i), 2.0 + 0.125 * i as f64, 0.5, 0.3)).collect();
    let template = scene(1, &Shape { gaussians: 1, width: 40, height: 16, objects: 1, ..Shape::default() });
    let gaussians = Gaussians { labels: Some(vec![0; 80]), ..Model { rows, ..Model::default() }.gaussians() };
    let crossroads = || Scene { camera: camera.clone(), gaussians: gaussians.clone(), ..template.clone() };
    for form in [short(), GroupBlend { turned: true, ..short() }] {
        let Some((of, counts)) = step(crossroads(), form, With::Nothing) else { return };
        assert_eq!(counts, [0, 1], "a list of 40 splats among shorter ones");
        let others = GroupBlend { long_list: u32::MAX, ..form };
        let (others, counts) = step(crossroads(), others, With::Nothing).expect("a device");
        assert_eq!(counts, [0, 0]);
        assert!(of == others, "order changes bits");
    }
}

#[test]
fn chunks_round_otherwise_and_count_the_same_splats() {
    let Some((of, _)) = step(crowded(), short(), With::Lift) else { return };
    let (whole, _) = step(crowded(), GroupBlend { chunk_length: 1024, ..short() }, With::Lift).expect("a device");
    assert!(of.last == whole.last, "what counts depends on chunks");
    assert!(of.gradients != whole.gradients, "there are no chunks");
}
