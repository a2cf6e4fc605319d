//! A whole step: losses and the gradient of every parameter against the mirror, from the model to the gradient.

use super::fixture::{BLENDS, Fixture, prove};
use crate::reference::step::step;
use crate::reference::{Row, Rules};
use crate::support::compare::{GradientBounds, Tolerance, Verdict, close};
use crate::support::device;
use crate::support::mutants::{Family, mutants};
use crate::support::scenes::{Shape, scene};
use labelgs::pass::GroupBlend;
use labelgs::scheduler::plan::Buf;
use labelgs::shaders::structs::StepUniforms;
use labelgs::verify::selftest::judge;

/// Errors of all passes add up; 0.89 of (1e-6, 5e-5) seen by element, 0.15 of (1e-5, 1e-10) as a whole.
const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 1.4e-6, relative: 6.7e-5 },
    outliers: 0.0,
    norm: 2.3e-6,
    angle: 2.3e-11,
    bias: 2.3e-6,
};

/// Gaussians with a decision nearer than this to its threshold are left out.
const MARGIN: f64 = 2e-5;

fn case(name: &str, seed: u64, shape: &Shape, labels: bool, bearing: &[&str]) {
    for form in BLENDS {
        case_of(form, name, (seed, shape, labels), bearing);
    }
}

fn case_of(form: Option<GroupBlend>, name: &str, (seed, shape, labels): (u64, &Shape, bool), bearing: &[&str]) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::blending(turn, scene(seed, shape), labels, form);
    let report = fixture.train();
    let actual = fixture.gradient_rows();
    // Records carry the stamp as a float, and a device may replace subnormal floats by 0.
    let [uniforms] = fixture.get::<StepUniforms>(Buf::STEP, 1)[..] else { panic!("no uniforms") };
    assert!(f32::from_bits(uniforms.stamp).is_normal(), "stamp {:#x}", uniforms.stamp);
    let (model, camera, mut target) = (fixture.model(), fixture.scene.camera.clone(), fixture.scene.target.clone());
    if !labels {
        target.slots.clear();
    }
    let scale = 1.0 / target.photo.elements();
    let sums = [report.counters.loss_l1, report.counters.loss_ssim].map(|v| f64::from(v) * scale);
    prove(name, bearing, |rules: &Rules| -> Verdict {
        let expected = step(rules, &camera, &model, &target);
        let loss = |l1: f64, ssim: f64| rules.l1_weight * l1 + rules.dssim_weight * (1.0 - ssim);
        close(&[loss(sums[0], sums[1])], &[expected.photo.value], Tolerance { absolute: 1e-5, relative: 0.0 })?;
        let sure: Vec<usize> = (0..actual.len()).filter(|&i| expected.margins[i] > MARGIN).collect();
        assert!(sure.len() * 10 > actual.len() * 6, "{} of {} Gaussians are sure", sure.len(), actual.len());
        let pick = |rows: &[Row]| sure.iter().map(|&i| rows[i]).collect::<Vec<_>>();
        judge::rows(&pick(&actual), &pick(&expected.rows), model.sh_degree, BOUNDS)
    });
}

fn named(families: &[Family], without: &[&str]) -> Vec<&'static str> {
    let bears = |m: &crate::support::mutants::Mutant| families.contains(&m.family) && !without.contains(&m.name);
    mutants().iter().filter(|m| bears(m)).map(|m| m.name).collect()
}

const ALL: [Family; 4] = [Family::Project, Family::Sh, Family::Blend, Family::Loss];

#[test]
fn gradients_of_a_step_equal_the_mirror() {
    // No splat is near the clamp of the Jacobian, and label weights have no effect without labels.
    let bearing = named(&ALL, &["label_weight", "label_alpha", "alpha_slack", "jacobian_margin"]);
    case("whole step", 61, &Shape { gaussians: 120, ..Shape::default() }, false, &bearing);
}

#[test]
fn gradients_of_a_step_with_labels_equal_the_mirror() {
    // Gradients of the label losses outweigh those of C1.
    let bearing = named(&ALL, &["jacobian_margin", "ssim_c1"]);
    case("whole step with labels", 62, &Shape { gaussians: 120, ..Shape::default() }, true, &bearing);
}

#[test]
fn gradients_of_a_step_on_opaque_gaussians_equal_the_mirror() {
    let shape = Shape { gaussians: 200, width: 61, height: 45, opacities: (-3.0, 9.0), ..Shape::default() };
    case("whole step, opaque", 63, &shape, true, &["alpha_max", "transmittance_min", "alpha_min", "dilation"]);
}
