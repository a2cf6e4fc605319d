//! Every constant matters: with one constant changed, the checks of the mirrors fail.

use crate::reference::adam::{AdamState, Rates, adam};
use crate::reference::densify::{densify, is_near, opacity_reset};
use crate::reference::lift::{Masks, centres_of, label_map, lift};
use crate::reference::model::ROW_FLOATS;
use crate::reference::moments::pack;
use crate::reference::relocate::{explored, relocate};
use crate::reference::smooth::smooth;
use crate::reference::step::{splats_of, step};
use crate::reference::{Model, Row, Rules};
use crate::support::compare::{Tolerance, close};
use crate::support::mutants::{Family, mutants};
use crate::support::scenes::{Scene, Shape, population, scene};
use crate::verify::gradient::differences;
use labelgs::verify::selftest::model::large;

/// Opaque and faint Gaussians, half of them far outside the image.
fn wide_scene() -> (Scene, Model) {
    let s = scene(40, &Shape { gaussians: 60, width: 32, height: 28, opacities: (-3.0, 9.0), ..Shape::default() });
    let mut model = s.model();
    for row in model.rows.iter_mut().step_by(2) {
        (row.mean[0], row.mean[1]) = (row.mean[0] * 2.5, row.mean[1] * 2.5);
        row.scale = row.scale.map(|v| v + 0.5);
    }
    (s, model)
}

/// All numbers that a family of mirrors computes.
fn outcome(family: Family, rules: &Rules, (s, model): &(Scene, Model)) -> Vec<f64> {
    let all = |rows: &[Row]| -> Vec<f64> { rows.iter().flat_map(Row::floats).collect() };
    match family {
        Family::Project | Family::Sh | Family::Blend | Family::Loss => {
            all(&step(rules, &s.camera, model, &s.target).rows)
        }
        Family::Smooth => {
            let sizes = |row: &Row| smooth(rules, &s.camera, 60.0, row, 0.0);
            model.rows.iter().map(sizes).flat_map(|(row, limit, _)| row.scale.into_iter().chain([limit])).collect()
        }
        Family::Adam => {
            let gradient = Row { mean: [1.0, 1e-6, 1e-9], ..Row::default() };
            let first = adam(rules, &Rates([1.0; 8]), 3, &AdamState::default(), &gradient);
            all(&[first.row, adam(rules, &Rates([1.0; 8]), 4, &first, &Row::default()).row])
        }
        Family::Moments => vec![f64::from(pack(rules, (1.5e-4, 1e-7), 0x7fff_7fff))],
        Family::Densify => {
            let noise = |row: usize, child: u32, axis: usize| ((row * 6 + axis) as f64 + 3.0 * f64::from(child)).sin();
            let densified = |(step, splits_long)| {
                let rules = Rules { splits_long, ..rules.clone() };
                all(&densify(&rules, &population(41, 300), 1.0, step, noise).model.rows)
            };
            [(500, false), (3100, false), (500, true)].map(densified).concat()
        }
        Family::FreeSpace => {
            let s = large(41);
            s.model().rows.iter().map(|row| f64::from(u8::from(is_near(rules, &s.camera, None, row).0))).collect()
        }
        Family::Relocate => all(&relocate(rules, &population(42, 300), 900, 0.3).model.rows),
        Family::Explore => {
            let row = Row { opacity: -5.0, quat: [1.0, 0.0, 0.0, 0.0], ..Row::default() };
            explored(rules, &row, 1.0, [1.0, 2.0, 3.0]).mean.to_vec()
        }
        Family::Reset => {
            let (mut row, mut m, mut u) = (Row { opacity: 2.0, ..Row::default() }, Row::default(), Row::default());
            opacity_reset(rules, &mut row, &mut m, &mut u);
            vec![row.opacity]
        }
        Family::Lift => {
            let out = step(rules, &s.camera, model, &s.target);
            let centres = centres_of(&splats_of(&out.splats), model.rows.len());
            let masks = Masks { label_map: &s.target.label_map, sampled: &[1, 2, 3], gpf: false };
            lift(rules, &out.layers[0], &centres, &masks).keys.iter().map(|&key| f64::from(key)).collect()
        }
        Family::LabelMap => {
            let splats = splats_of(&step(rules, &s.camera, model, &s.target).splats);
            let size = (s.camera.width as usize, s.camera.height as usize);
            label_map(rules, &splats, &model.labels, size).iter().map(|pixel| f64::from(pixel.label)).collect()
        }
    }
}

#[test]
fn changing_a_constant_fails_the_checks_of_its_family() {
    let setting = wide_scene();
    let families: Vec<Family> = mutants().iter().map(|m| m.family).collect();
    let mut expected: Vec<(Family, Vec<f64>)> = Vec::new();
    for family in families {
        if expected.iter().all(|(known, _)| *known != family) {
            expected.push((family, outcome(family, &Rules::default(), &setting)));
        }
    }
    for mutant in mutants() {
        let right = &expected.iter().find(|(family, _)| *family == mutant.family).expect("made above").1;
        let wrong = outcome(mutant.family, &mutant.rules, &setting);
        let largest = right.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        assert!(largest > 0.0);
        let verdict = close(&wrong, right, Tolerance { absolute: 1e-6 * largest, relative: 1e-6 });
        assert!(verdict.is_err(), "{} changes nothing", mutant.name);
    }
}

/// The check of `gradient::whole_step` must see an analytic gradient of other constants.
#[test]
fn a_gradient_with_a_changed_constant_is_detected() {
    let shape = Shape { gaussians: 6, width: 20, height: 16, objects: 2, ..Shape::default() };
    let (rules, s) = (Rules::default(), scene(42, &shape));
    let model = s.model();
    let parameters: Vec<f64> = model.rows.iter().flat_map(Row::floats).collect();
    let numeric = differences(&parameters, |p| {
        let rows = p.as_chunks::<ROW_FLOATS>().0.iter().map(Row::from_floats).collect();
        step(&rules, &s.camera, &Model { rows, ..model.clone() }, &s.target).value
    });
    let largest = numeric.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let seen =
        ["dilation", "colour_bias", "sh_c0", "sh_c1", "sh_c2", "sh_c3", "l1_weight", "dssim_weight", "label_weight"];
    for mutant in mutants().into_iter().filter(|m| seen.contains(&m.name) || m.name.starts_with("ssim")) {
        let rows = step(&mutant.rules, &s.camera, &model, &s.target).rows;
        let analytic: Vec<f64> = rows.iter().flat_map(Row::floats).collect();
        let verdict = close(&analytic, &numeric, Tolerance { absolute: 1e-6 * largest, relative: 1e-6 });
        let text = verdict.expect_err(mutant.name);
        assert!(text.contains("times the tolerance"), "{}: {text}", mutant.name);
    }
}
