//! Adversarial models on the device against float64, from the model to the picture and the gradient.
//!
//! Bounds are about five times the errors on lavapipe: f32 rounds by 6e-8, exponents of about 5 add their rounding
//! errors, and a pixel sums tens of such terms. A scene with a larger bound gives the reason.

use crate::pass::fixture::Fixture;
use crate::reference::model::flatten;
use crate::reference::step::step;
use crate::reference::{Group, Rules};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, plain_camera, scene};
use labelgs::scene::Gaussians;

/// Bounds of one adversary.
struct Bound {
    /// Largest error of a colour where no decision (cut, stop, order) is near, and its reason.
    colour: f64,
    /// Largest relative error in norm of the gradient of a kind of parameter, over the Gaussians without a decision
    /// near its threshold, or over all Gaussians where few are left.
    gradient: f64,
}

/// A decision nearer to its threshold than this may go either way.
const DECISION_MARGIN: f64 = 1e-4;

/// Runs a step, compares, and prints the errors.
fn holds(name: &str, scene: Scene, labels: bool, bound: Bound) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, scene, labels);
    fixture.train();
    let pixels = fixture.pixels();
    let image = fixture.get::<[f32; 4]>(labelgs::scheduler::plan::Buf::IMAGE, pixels);
    let actual = fixture.gradient_rows();
    let (model, camera, mut target) = (fixture.model(), fixture.scene.camera.clone(), fixture.scene.target.clone());
    if !labels {
        target.slots.clear();
    }
    let expected = step(&Rules::default(), &camera, &model, &target);
    let mut colour = 0.0_f64;
    let mut compared = 0;
    for (found, wanted) in image.iter().zip(&expected.layers[0].pixels) {
        assert!(found.iter().all(|v| v.is_finite()), "{name}: a pixel is {found:?}");
        if wanted.margins.image() > DECISION_MARGIN {
            compared += 1;
            (0..3).for_each(|c| colour = colour.max((f64::from(found[c]) - wanted.colour[c]).abs()));
        }
    }
    let mut sure: Vec<usize> = (0..actual.len()).filter(|&i| expected.margins[i] > DECISION_MARGIN).collect();
    if sure.len() * 4 < actual.len() {
        // Every splat reaches its cut somewhere, so the bound includes flips there.
        sure = (0..actual.len()).collect();
    }
    let pick = |rows: &[crate::reference::Row]| sure.iter().map(|&i| rows[i]).collect::<Vec<_>>();
    let (found, wanted) = (pick(&actual), pick(&expected.rows));
    let mut gradient = 0.0_f64;
    for group in Group::ALL.into_iter().take(5 + model.sh_degree as usize) {
        let (found, wanted) = (flatten(&found, group), flatten(&wanted, group));
        assert!(found.iter().all(|v| v.is_finite()), "{name}: a gradient of {group:?} is not finite");
        let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
        let size = norm(&mut wanted.iter().copied());
        let error = norm(&mut found.iter().zip(&wanted).map(|(a, b)| a - b));
        let error = if size > 0.0 { error / size } else { error };
        if error > bound.gradient {
            println!("{name}: {group:?} {error:.1e} of {size:.1e}");
        }
        gradient = gradient.max(error);
    }
    println!(
        "{name}: colours {colour:.1e} of {:.1e} ({compared} of {pixels} pixels), gradients {gradient:.1e} of {:.1e} \
         ({} of {} Gaussians)",
        bound.colour,
        bound.gradient,
        sure.len(),
        actual.len()
    );
    assert!(compared * 3 > pixels, "{name}: only {compared} of {pixels} pixels are sure");
    assert!(colour <= bound.colour, "{name}: a colour is off by {colour:.1e}");
    assert!(gradient <= bound.gradient, "{name}: gradients are off by {gradient:.1e} in norm");
}

/// A random scene, changed.
fn changed(seed: u64, shape: Shape, change: impl Fn(usize, &mut Gaussians)) -> Scene {
    let mut made = scene(seed, &shape);
    (0..made.gaussians.len()).for_each(|row| change(row, &mut made.gaussians));
    made
}

fn small() -> Shape {
    Shape { gaussians: 80, ..Shape::default() }
}

/// Axes of 1e6 : 1 in every rotation. The conic's small eigenvalue is 1e-6 of the large one, so the exponent is a small
/// difference of terms ten times as large.
#[test]
fn needles_stay_within_the_bound() {
    let made = changed(201, small(), |row, g| g.scales[row] = [0.0, (1e-6_f32).ln(), (1e-6_f32).ln()]);
    holds("needles", made, true, Bound { colour: 5e-5, gradient: 1.1e-4 });
}

/// Flat discs with one axis below the f32 spacing of positions.
#[test]
fn discs_stay_within_the_bound() {
    let made = changed(202, small(), |row, g| g.scales[row] = [-1.0, -1.5, -30.0]);
    holds("discs", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// Far below a pixel: the blur alone makes the splat.
#[test]
fn points_stay_within_the_bound() {
    let made = changed(203, small(), |row, g| g.scales[row] = [-15.0, -14.0, -13.0]);
    holds("points", made, true, Bound { colour: 1.1e-5, gradient: 2e-5 });
}

/// Larger than the scene: every pixel sees the middle of every splat.
#[test]
fn giants_stay_within_the_bound() {
    let made = changed(204, small(), |row, g| {
        g.scales[row] = [6.0, 7.0, 5.0];
        g.opacities[row] = -3.0;
    });
    holds("giants", made, false, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// Quaternions of any length whose square fits f32.
#[test]
fn rotations_of_any_length_stay_within_the_bound() {
    let made = changed(205, small(), |row, g| {
        let length = [1e-15_f32, 1e-6, 1.0, 1e6, 1e15][row % 5];
        g.quats[row] = g.quats[row].map(|v| v * length);
    });
    holds("rotations of any length", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// Quaternions whose square overflows or underflows f32 are still rotations. At length 1e-20 the gradient is 1e20 times
/// as large as at length 1. Gradients beyond 1e18 are dropped, so it is missing but never wrong.
#[test]
fn rotations_whose_square_overflows_stay_within_the_bound() {
    let of_length = |length: f32| changed(213, small(), |row, g| g.quats[row] = g.quats[row].map(|v| v * length));
    holds("rotations of 1e20", of_length(1e20), true, Bound { colour: 5e-6, gradient: 1.1e-5 });
    holds("rotations of 1e-20", of_length(1e-20), true, Bound { colour: 5e-6, gradient: 1.0 });
}

/// A quaternion of length 0 projects to NaN: the Gaussian has no splat and is counted.
#[test]
fn rotations_of_length_zero_are_counted_and_not_drawn() {
    let Some(turn) = device() else { return };
    let made = changed(214, small(), |row, g| {
        if row % 8 == 0 {
            g.quats[row] = [0.0; 4];
        }
    });
    let mut fixture = Fixture::new(turn, made, true);
    let counters = fixture.train().counters;
    assert_eq!(counters.unprojected_first, 0);
    assert!((1..=10).contains(&counters.unprojected_count), "{counters:?}");
    assert!(fixture.gradient_rows().iter().all(|row| row.floats().iter().all(|value| value.is_finite())));
    let pixels = fixture.pixels();
    let image = fixture.get::<[f32; 4]>(labelgs::scheduler::plan::Buf::IMAGE, pixels);
    assert!(image.iter().flatten().all(|value| value.is_finite()));
}

/// The smallest scales, and scales whose fourth power just fits f32. Scales are not clamped; Gaussians with larger ones
/// are counted and not drawn (`sentinel`).
#[test]
fn scales_at_both_limits_of_f32_stay_within_the_bound() {
    let made = changed(215, small(), |row, g| {
        g.scales[row] = if row % 2 == 0 { [-44.0; 3] } else { [18.0, 17.0, 19.0] };
        g.opacities[row] = -3.0;
    });
    holds("scales at both ends", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// One pixel wide, one pixel high, and a single pixel. The last one's gradient by scales is 4e-4 in norm and off by
/// 2e-8: it is a small difference of terms, and 2e-8 is their rounding error in f32.
#[test]
fn pictures_of_one_pixel_stay_within_the_bound() {
    for (width, height, gradient) in [(1, 17, 1.1e-5), (17, 1, 1.1e-5), (1, 1, 2.2e-4)] {
        let made = scene(216, &Shape { width, height, ..small() });
        holds(&format!("{width} x {height} px"), made, true, Bound { colour: 5e-6, gradient });
    }
}

/// Opacities from 0 to 1: a logit of 15 is 3e-7 below 1, a logit of 100 rounds to 1.
#[test]
fn opacities_at_their_limits_stay_within_the_bound() {
    let made = changed(206, small(), |row, g| g.opacities[row] = [-100.0, -15.0, -5.5, 0.0, 15.0, 100.0][row % 6]);
    holds("opacities at their ends", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

fn stack(count: usize, opacity: f64, depth: impl Fn(usize) -> f32) -> Scene {
    let mut made = scene(207, &Shape { gaussians: 1, width: 24, height: 20, ..small() });
    made.camera = plain_camera(24, 20);
    let logit = (opacity / (1.0 - opacity)).ln() as f32;
    let colour = |i: usize| [(i % 7) as f32 * 0.2 - 0.6, (i % 5) as f32 * 0.3 - 0.6, (i % 3) as f32 * 0.5 - 0.5];
    made.gaussians = Gaussians {
        means: (0..count).map(|i| [(i % 9) as f32 * 1e-3, (i % 4) as f32 * 1e-3, depth(i)]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: vec![[1.0, 1.0, -4.0]; count],
        opacities: vec![logit; count],
        sh0: (0..count).map(colour).collect(),
        labels: Some((0..count).map(|i| (i % 4) as u32).collect()),
        ..Gaussians::default()
    };
    made
}

/// 2,000 layers of alpha 0.01: transmittance is a product of 2,000 factors, and the backward pass divides by each.
#[test]
fn two_thousand_faint_layers_stay_within_the_bound() {
    let made = stack(2000, 0.01, |i| 4.0 + i as f32 * 1e-3);
    holds("2,000 faint layers", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// Every alpha at its clamp: two layers leave a transmittance of 1e-4 up to rounding, exactly where a pixel stops. The
/// pixel may stop one layer later, and that layer has a ten-thousandth of the weight.
#[test]
fn layers_at_the_clamp_stay_within_the_bound() {
    let made = stack(60, 0.9999, |i| 4.0 + i as f32 * 1e-2);
    holds("layers at the clamp", made, true, Bound { colour: 5e-6, gradient: 1e-3 });
}

/// Equal depths: device and mirror both keep the order of rows.
#[test]
fn ties_of_depth_stay_within_the_bound() {
    let made = stack(400, 0.05, |_| 5.0);
    holds("ties of depth", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}

/// Centres on the near plane and one f32 before and behind it, and large splats across it.
#[test]
fn splats_across_the_near_plane_stay_within_the_bound() {
    let near = 0.2_f32;
    let depths = [near, f32::from_bits(near.to_bits() + 1), f32::from_bits(near.to_bits() - 1), -1.0, 0.21, 0.5];
    let mut made = stack(120, 0.3, |i| if i % 2 == 0 { depths[i / 2 % 6] } else { 4.0 + i as f32 * 0.01 });
    made.gaussians.scales.iter_mut().for_each(|scale| *scale = [-3.0, -3.0, 0.0]);
    holds("across the near plane", made, true, Bound { colour: 5e-6, gradient: 2e-5 });
}

/// Fields of view of 170 and of 1 degree.
#[test]
fn wide_and_narrow_cameras_stay_within_the_bound() {
    for (name, degrees) in [("170 degrees", 170.0_f64), ("1 degree", 1.0)] {
        let mut made = scene(209, &small());
        let focal = 24.0 / (degrees.to_radians() / 2.0).tan();
        (made.camera.fx, made.camera.fy) = (f64::from(focal as f32), f64::from(focal as f32));
        holds(name, made, true, Bound { colour: 5e-6, gradient: 2e-5 });
    }
}

/// Harmonics of 1e6: colours far beyond any photo, negative ones clamped to 0.
#[test]
fn harmonics_beyond_photo_colours_stay_within_the_bound() {
    let made = changed(210, small(), |row, g| {
        let rest = g.rest_per_gaussian();
        g.sh0[row] = [1e6, -1e6, 1.0];
        g.sh_rest[row * rest..(row + 1) * rest].iter_mut().for_each(|v| *v = [1e5, -1e5, 0.1]);
    });
    holds("harmonics of 1e6", made, true, Bound { colour: 2.0, gradient: 1.1e-5 });
}

/// Harmonics of 3e38: a finite sum is a colour, and its gradient overflows and is dropped. A sum that overflows has no
/// splat. Both are counted, and every other number of the step stays finite.
#[test]
fn harmonics_that_overflow_f32_are_counted_and_leave_no_nan() {
    let Some(turn) = device() else { return };
    let made = changed(217, small(), |row, g| {
        let rest = g.rest_per_gaussian();
        if row % 8 == 0 {
            g.sh0[row] = [3e38, -3e38, 1.0];
            g.sh_rest[row * rest..(row + 1) * rest].iter_mut().for_each(|v| *v = [3e38, -3e38, 0.1]);
        }
    });
    let mut fixture = Fixture::new(turn, made, true);
    let counters = fixture.train().counters;
    assert!(counters.unprojected_count > 0 && counters.nonfinite_count > 0, "{counters:?}");
    assert!(counters.unprojected_first.is_multiple_of(8), "{counters:?}");
    let pixels = fixture.pixels();
    let image = fixture.get::<[f32; 4]>(labelgs::scheduler::plan::Buf::IMAGE, pixels);
    assert!(image.iter().flatten().all(|value| value.is_finite()), "a pixel is not finite");
    assert!(image.iter().flatten().any(|value| *value > 1e30), "what is a float is drawn");
    assert!(fixture.gradient_rows().iter().flat_map(|row| row.floats()).all(f64::is_finite));
}

/// A mask of the whole picture, an empty mask, and the smallest and the largest label.
#[test]
fn masks_and_labels_at_their_limits_stay_within_the_bound() {
    for (name, id) in [("a mask of everything", 1_u32), ("the largest label", 65_535)] {
        let mut made = scene(211, &Shape { objects: 1, ..small() });
        made.target.label_map.fill(id);
        made.target.slots.iter_mut().for_each(|slot| slot.label = id);
        made.gaussians.labels.iter_mut().flatten().for_each(|label| *label *= id);
        holds(name, made, true, Bound { colour: 5e-6, gradient: 2e-5 });
    }
    let mut made = scene(212, &Shape { objects: 1, ..small() });
    made.target.label_map.fill(0);
    holds("a mask of nothing", made, true, Bound { colour: 5e-6, gradient: 1.1e-5 });
}
