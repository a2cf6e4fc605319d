//! The passes of the strategy mcmc.

use super::fixture::{prove, readable};
use crate::reference::Row;
use crate::reference::relocate::regularised;
use crate::support::compare::{Tolerance, close};
use crate::support::device;
use crate::support::device::Turn;
use crate::support::scenes::{Scene, Shape, population, scene, scene_of};
use crate::verify::gradient::differences;
use labelgs::pass::KernelShape;
use labelgs::verify::selftest::fixture::Fixture;
use labelgs::verify::selftest::relocation::{exploration, relocation};

fn rig(turn: &Turn, scene: Scene) -> labelgs::Result<Fixture> {
    Fixture::new(turn.gpu(), scene, true, KernelShape::for_device(turn.capabilities()), readable())
}

#[test]
fn relocation_equals_its_mirror() {
    let Some(turn) = device() else { return };
    // Few Gaussians, so that no start of a stack is too close to a draw.
    for (count, draws, bearing) in [
        (500, 0, &["prune_opacity", "stat_near"][..]),
        (200, 300, &["relocate_one", "prune_opacity", "stat_near"]),
        (20, 400, &["relocate_one", "relocate_most"]),
    ] {
        let before = population(712, count);
        let mut fixture = rig(&turn, scene_of(&before)).expect("the engine starts");
        let judge = relocation(&mut fixture, before, draws, 1.0).expect("it runs");
        prove(&format!("{draws} draws"), bearing, judge);
    }
}

#[test]
fn random_moves_and_regularisation_equal_their_mirrors() {
    let Some(turn) = device() else { return };
    let scene = scene(66, &Shape { gaussians: 150, opacities: (-7.0, 3.0), ..Shape::default() });
    let [moves, terms] = exploration(|| rig(&turn, scene.clone()), 1.0).expect("it runs");
    prove("random moves", &["noise_steep", "noise_opacity"], moves);
    prove("regularisation", &[], terms);
}

#[test]
fn regularisation_is_the_gradient_of_its_terms() {
    let weights = [0.3, 0.7];
    for row in scene(67, &Shape { gaussians: 5, ..Shape::default() }).model().rows {
        let numeric =
            differences(&row.floats(), |p| regularised(&Row::from_floats(p.try_into().expect("a row")), weights).0);
        let tolerance = Tolerance { absolute: 1e-9, relative: 1e-6 };
        close(&regularised(&row, weights).1.floats(), &numeric, tolerance).expect("its gradient");
    }
}
