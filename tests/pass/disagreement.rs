//! The disagreement of labels in a step: value and gradient against the mirror.

use super::fixture::{BLENDS, Fixture, prove};
use crate::reference::disagreement::disagreement;
use crate::support::compare::{GradientBounds, Tolerance, check, close, exact, gradients};
use crate::support::device;
use crate::support::scenes::{Shape, scene};
use labelgs::pass::GroupBlend;
use labelgs::run::LabelRule;

/// Gradients of the photo are 1e-5 of those of the labels, and both are sums in f32; 0.6 of it seen.
pub(super) const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 4e-6, relative: 4e-5 },
    outliers: 0.0,
    norm: 4e-6,
    angle: 4e-6,
    bias: 4e-6,
};

/// Weight of the labels, far above that of the photo.
const LABEL_WEIGHT: f32 = 1e5;

#[test]
fn disagreement_of_a_step_equals_its_mirror_and_moves_opacities_only() {
    BLENDS.into_iter().for_each(disagreement_of_a_step_equals_its_mirror_and_moves_opacities_only_of);
}

fn disagreement_of_a_step_equals_its_mirror_and_moves_opacities_only_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let shape = Shape { gaussians: 150, width: 61, height: 45, opacities: (-4.0, 7.0), ..Shape::default() };
    let mut fixture = Fixture::blending(turn, scene(64, &shape), true, form);
    fixture.config.label_rule = LabelRule::Votes;
    fixture.config.label_weight = LABEL_WEIGHT;
    fixture.input.layers.clear();
    let report = fixture.train();
    let splats = fixture.splats();
    let count = splats.len();
    let with: Vec<[f32; 12]> = fixture.splat_records();
    fixture.input.labels = false;
    fixture.train();
    let without: Vec<[f32; 12]> = fixture.splat_records();
    let others = |rows: &[[f32; 12]]| -> Vec<f32> {
        rows.iter().flat_map(|row| [0, 1, 2, 3, 4, 6, 7, 8].map(|i| row[i])).collect()
    };
    check("all but opacities", exact(&others(&with), &others(&without)));

    let (model, target) = (fixture.model(), fixture.scene.target.clone());
    assert!(model.labels.contains(&0) && model.labels.iter().any(|&label| label > 0));
    let steps = f64::from(fixture.config.disagreement_every());
    let weight = steps * f64::from(LABEL_WEIGHT) / target.photo.elements();
    let pixels: Vec<Option<(u32, f64)>> = (target.label_map.iter().zip(&target.photo.valid))
        .map(|(&here, &valid)| (valid && here <= 0xffff).then_some((here, weight)))
        .collect();
    assert!(pixels.contains(&None), "some pixels do not count");
    let change = |row: usize| f64::from(with[row][5]) - f64::from(without[row][5]);
    prove("disagreement", &["label_weight", "alpha_min", "alpha_max"], |rules| {
        let expected = disagreement(rules, &splats, &model.labels, fixture.size(), &pixels);
        // A sum of 2745 pixels in f32.
        let value = [f64::from(report.counters.loss_label)];
        close(&value, &[expected.value], Tolerance { absolute: 0.0, relative: 2e-6 })?;
        let sure: Vec<usize> = (0..count).filter(|&row| expected.margins[row] > 1e-5).collect();
        assert!(sure.len() * 10 > count * 4, "{} of {count} splats are sure", sure.len());
        let actual: Vec<f64> = sure.iter().map(|&row| change(row)).collect();
        // The record has the derivative with respect to ln o.
        let wanted: Vec<f64> = sure.iter().map(|&row| expected.v_opacities[row] * splats[row].opacity).collect();
        gradients(&actual, &wanted, BOUNDS)
    });
}
