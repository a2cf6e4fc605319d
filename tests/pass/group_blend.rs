//! Blends by workgroups: what may not change a bit.

use super::fixture::{BLENDS, Fixture};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::pass::{GroupBlend, KernelShape};
use labelgs::scheduler::plan::Buf;

/// What a step leaves, as bits.
#[derive(Debug, PartialEq)]
struct Step {
    picture: Vec<u32>,
    last: Vec<u32>,
    gradients: Vec<u32>,
    losses: [u32; 3],
}

/// A step with object layers.
fn step(form: GroupBlend) -> Option<Step> {
    let turn = device()?;
    let shape = KernelShape::of(turn.capabilities()).with_group_blend_of(form);
    let crowded = Shape { gaussians: 200, width: 29, height: 19, opacities: (-4.0, 9.0), ..Shape::default() };
    let mut fixture = Fixture::with_shape(turn, scene(56, &crowded), true, shape);
    let counters = fixture.train().counters;
    assert!(counters.longest_list > 64, "lists have {} splats at most", counters.longest_list);
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
    let [_, Some(short)] = BLENDS else { panic!("a form by workgroups") };
    let Some(of) = step(short) else { return };
    assert!(of == step(GroupBlend { culls: false, ..short }).expect("a device"), "skipping changes bits");
    assert!(of == step(GroupBlend { turned: true, ..short }).expect("a device"), "order changes bits");
    // Sums over chunks round otherwise, so there are several.
    let whole = step(GroupBlend { chunk_length: 1024, ..short }).expect("a device");
    assert!(of.last == whole.last, "what counts depends on chunks");
    assert!(of.gradients != whole.gradients, "there are no chunks");
}
