//! Antialiased models.

use super::fixture::{prove, readable};
use crate::support::device;
use crate::support::device::Turn;
use crate::support::scenes::Scene;
use labelgs::pass::KernelShape;
use labelgs::verify::selftest::antialias::{around, fine, sizes, step};
use labelgs::verify::selftest::fixture::Fixture;

fn rig(turn: &Turn, scene: Scene) -> labelgs::Result<Fixture> {
    Fixture::new(turn.gpu(), scene, false, KernelShape::for_device(turn.capabilities()), readable())
}

#[test]
fn antialiased_splats_and_their_gradients_equal_their_mirrors() {
    let Some(turn) = device() else { return };
    let mut fixture = rig(&turn, fine(95)).expect("the engine starts");
    let judge = step(&mut fixture, 1.0).expect("it runs");
    prove("antialiased", &["antialiased", "dilation"], judge);
}

#[test]
fn least_sizes_equal_their_mirror() {
    let Some(turn) = device() else { return };
    let judge = sizes(|| rig(&turn, around(96)), 1.0).expect("it runs");
    prove("smooth", &["finest", "smooth_margin"], judge);
}
