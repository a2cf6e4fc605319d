//! Packed moments: updates of each form against their mirror, word by word, and changes of the number of Gaussians.

use super::fixture::{Fixture, prove, readable};
use crate::support::compare::Tolerance;
use crate::support::device;
use crate::support::scenes::{population, scene_of};
use labelgs::engine::EngineSize;
use labelgs::pass::{KernelShape, Update};
use labelgs::verify::selftest::fixture;
use labelgs::verify::selftest::model::{densification, reset};
use labelgs::verify::selftest::moments::{away, packed, round};
use labelgs::verify::selftest::relocation::relocation;

const BEARING: [&str; 5] = ["adam_beta1", "adam_beta2", "moment_ratio", "moment_log", "moment_floor"];

#[test]
fn packed_moments_of_every_attribute_equal_their_mirror() {
    for texel in [false, true] {
        let Some(turn) = device() else { return };
        let shape = KernelShape { texel, update: Update::Split, ..KernelShape::for_device(turn.capabilities()) };
        let judge = packed(&mut Fixture::with_moments(turn, away(106), true, shape, true), None).expect("it runs");
        prove("packed moments", &BEARING, judge);
    }
}

#[test]
fn packed_moments_of_one_kernel_and_of_late_gaussians_equal_their_mirror() {
    // With labels, lavapipe has too few bindings without texel reads.
    for (labels, texel) in [(true, true), (false, false)] {
        let Some(turn) = device() else { return };
        let gpu = turn.gpu();
        let shape = KernelShape { group_walks: true, texel, ..KernelShape::for_device(turn.capabilities()) };
        let lazy = KernelShape { update: Update::Lazy, ..shape };
        let mut split = fixture::Fixture::new(gpu, away(107), labels, shape, readable()).expect("it starts");
        let mut late = Fixture::with_moments(turn, away(107), labels, lazy, true);
        let judge = packed(&mut late, Some(&mut split)).expect("it runs");
        prove("packed moments of late Gaussians", &BEARING, judge);
    }
}

/// Words are copied bit by bit, also those that no float may have; new Gaussians have none.
#[test]
fn densification_relocation_and_reset_keep_packed_moments() {
    let tolerance = Tolerance { absolute: 1e-6, relative: 3.5e-8 };
    for texel in [false, true] {
        let Some(turn) = device() else { return };
        let rig = |scene| {
            let shape = KernelShape { texel, ..KernelShape::for_device(turn.capabilities()) };
            let with = |room: EngineSize| room.with_half_moments(true);
            fixture::Fixture::with_room(turn.gpu(), scene, true, (shape, readable()), with).expect("it starts")
        };
        let mut before = population(710, 500);
        round(&mut before);
        let judge = densification(&mut rig(scene_of(&before)), before.clone(), (600, true), tolerance);
        prove("densification", &["densify_gradient"], judge.expect("it runs"));
        let judge = reset(&mut rig(scene_of(&before)), before, 1.0).expect("it runs");
        prove("reset", &["reset_opacity"], judge);
        let mut before = population(712, 200);
        round(&mut before);
        let judge = relocation(&mut rig(scene_of(&before)), before, 300, 1.0).expect("it runs");
        prove("relocation", &["relocate_one"], judge);
    }
}
