//! Known depths in a step: the gradient against the mirror.

use super::disagreement::BOUNDS;
use super::fixture::{BLENDS, Fixture, prove};
use crate::reference::disagreement::depth_error;
use crate::support::compare::{check, exact, gradients};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::pass::GroupBlend;

/// Weight of the depths, far above that of the photo.
const PRIOR_WEIGHT: f64 = 1e5;

#[test]
fn known_depths_move_opacities_as_their_mirror_says_and_nothing_else() {
    BLENDS.into_iter().for_each(known_depths_move_opacities_as_their_mirror_says_and_nothing_else_of);
}

fn known_depths_move_opacities_as_their_mirror_says_and_nothing_else_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let shape = Shape { gaussians: 150, width: 61, height: 45, opacities: (-4.0, 7.0), ..Shape::default() };
    let mut fixture = Fixture::blending(turn, scene(64, &shape), false, form);
    // Constant over the first step of many.
    (fixture.config.iterations, fixture.config.label_from) = (1_000_000_000, None);
    fixture.config.depth_weight = Some(PRIOR_WEIGHT);
    fixture.train();
    let splats = fixture.splats();
    let count = splats.len();
    let without: Vec<[f32; 12]> = fixture.splat_records();
    let middle = splats.iter().map(|splat| splat.depth).sum::<f64>() / count as f64;
    let pixels = fixture.size().0 * fixture.size().1;
    let known = |at: usize| [0.0, 0.5 / middle, 1.0 / middle, 1.5 / middle][at % 4] as f32;
    fixture.view.depths = (0..pixels).map(known).collect();
    fixture.train();
    let with: Vec<[f32; 12]> = fixture.splat_records();
    let others = |rows: &[[f32; 12]]| -> Vec<f32> {
        rows.iter().flat_map(|row| [0, 1, 2, 3, 4, 6, 7, 8].map(|i| row[i])).collect()
    };
    check("all but opacities", exact(&others(&with), &others(&without)));
    let inverse: Vec<f64> = fixture.view.depths.iter().map(|&inverse| f64::from(inverse)).collect();
    let weight = PRIOR_WEIGHT / inverse.iter().filter(|&&inverse| inverse > 0.0).count() as f64;
    let change = |row: usize| f64::from(with[row][5]) - f64::from(without[row][5]);
    prove("known depths", &["alpha_min", "alpha_max"], |rules| {
        let expected = depth_error(rules, &splats, fixture.size(), &inverse, weight);
        let sure: Vec<usize> = (0..count).filter(|&row| expected.margins[row] > 1e-5).collect();
        assert!(sure.len() * 10 > count * 4, "{} of {count} splats are sure", sure.len());
        let actual: Vec<f64> = sure.iter().map(|&row| change(row)).collect();
        // The record has the derivative with respect to ln o.
        let wanted: Vec<f64> = sure.iter().map(|&row| expected.v_opacities[row] * splats[row].opacity).collect();
        gradients(&actual, &wanted, BOUNDS)
    });
}
