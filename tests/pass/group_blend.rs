//! Blends by workgroups: what may not change a bit, and how long lists are cut.

use super::blend::opaque_scene;
use super::fixture::Fixture;
use crate::support::device;
use labelgs::pass::{GroupBlend, KernelShape};
use labelgs::scheduler::plan::Buf;

/// Chunks of 8 splats: lists of the scene have some twenty.
const SHORT: GroupBlend = GroupBlend { chunk_length: 8, ..GroupBlend::DEFAULT };

/// What a step leaves, as bits.
#[derive(Debug, PartialEq)]
struct Step {
    picture: Vec<u32>,
    last: Vec<u32>,
    gradients: Vec<u32>,
    losses: [u32; 3],
}

fn step(form: GroupBlend, labels: bool) -> Option<Step> {
    let turn = device()?;
    let shape = KernelShape::of(turn.capabilities()).with_group_blend_of(form);
    let mut fixture = Fixture::with_shape(turn, opaque_scene(56), labels, shape);
    let counters = fixture.train().counters;
    assert!(counters.longest_list > 5 * SHORT.chunk_length, "lists have {} splats at most", counters.longest_list);
    let (pixels, splats) = (fixture.pixels(), counters.visible_count as usize);
    Some(Step {
        picture: fixture.get(Buf::IMAGE, 4 * pixels),
        last: fixture.get(Buf::LAST, pixels),
        gradients: fixture.get(Buf::V_SPLATS, 12 * splats),
        losses: [counters.loss_l1, counters.loss_ssim, counters.loss_label].map(f32::to_bits),
    })
}

#[test]
fn neither_skipping_nor_the_order_of_workgroups_changes_a_bit() {
    for labels in [false, true] {
        let Some(of) = step(SHORT, labels) else { return };
        assert!(of == step(GroupBlend { culls: false, ..SHORT }, labels).expect("a device"), "skipping changes bits");
        assert!(of == step(GroupBlend { turned: true, ..SHORT }, labels).expect("a device"), "order changes bits");
    }
}

/// Sums over chunks round otherwise: lengths differ in bits, so that the mirrors' tests see the length that they ask for.
#[test]
fn the_length_of_a_chunk_is_what_the_shape_says() {
    let Some(short) = step(SHORT, false) else { return };
    let whole = step(GroupBlend { chunk_length: 1024, ..SHORT }, false).expect("a device");
    assert!(short.last == whole.last, "what counts depends on chunks");
    assert!(short.gradients != whole.gradients, "there are no chunks");
}
