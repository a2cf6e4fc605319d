//! Lift, label loss, and independence of densification from labels.

use super::fixture::{Fixture, prove};
use crate::reference::blend::blend_layers_forward;
use crate::reference::loss::{ObjectPixel, Photo, label_loss};
use crate::reference::step::Target;
use crate::reference::{Model, Row, Rules};
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::device;
use crate::support::scenes::{Scene, dot, plain_camera};
use labelgs::scheduler::plan::Buf;
use labelgs::train::input::step_input;
use labelgs::verify::selftest::model::{dominant, lift};

#[test]
fn lift_equals_its_mirror_with_and_without_the_filter() {
    for gpf in [true, false] {
        let Some(turn) = device() else { return };
        let mut fixture = Fixture::new(turn, dominant(131), true);
        fixture.config.gpf = gpf;
        // One object of the masks is not sampled.
        fixture.input.layers.pop();
        let count = fixture.scene.gaussians.len();
        let judge = lift(&mut fixture).expect("it runs");
        prove(&format!("lift, filter {gpf}"), &["lift_threshold"], judge);
        assert!(fixture.get::<u32>(Buf::LABEL_KEYS, count).iter().all(|&key| key == 0), "votes start over");
    }
}

#[test]
fn label_loss_of_a_step_equals_its_mirror() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, dominant(132), true);
    let counters = fixture.train().counters;
    let (splats, size, labels, slots) = (fixture.splats(), fixture.size(), fixture.model().labels, fixture.slots());
    let target = fixture.scene.target.clone();
    assert!(target.slots.iter().any(|slot| !slot.occluders.is_empty()));
    let actual = step_input::label_loss(
        &fixture.input,
        fixture.view.step_view(&fixture.scene),
        &fixture.config,
        counters.loss_label,
    );
    assert!(target.slots.iter().any(|slot| slot.weight != 1.0), "objects of different sizes weigh differently");
    prove("label loss", &["label_weight", "label_alpha", "alpha_slack"], |rules| {
        let layers = blend_layers_forward(rules, &splats, &labels, &slots, size, target.background);
        let losses = target.slots.iter().zip(&layers[1..]).map(|(slot, layer)| {
            label_loss(rules, (&layer.colours(), &layer.alphas()), &target.photo, &target.label_map, slot)
        });
        // An f32 sum less the host's constant; 3e-8 seen.
        close(&[actual], &[losses.map(|loss| loss.value).sum()], Tolerance { absolute: 0.0, relative: 1e-7 })
    });
}

/// The statistic of densification comes from the layer of the scene only.
#[test]
fn the_label_loss_does_not_drive_densification() {
    let run = |label_weight: f32| -> Option<(Vec<u32>, Vec<u32>)> {
        let mut fixture = Fixture::new(device()?, dominant(133), true);
        fixture.config.label_weight = label_weight;
        fixture.train();
        let count = fixture.scene.gaussians.len();
        let splats = fixture.splats().len();
        Some((fixture.get(Buf::DENSIFY_STATS, 2 * count), fixture.get(Buf::V_MEANS, 4 * splats)))
    };
    let (Some(without), Some(with)) = (run(0.0), run(1e6)) else { return };
    assert!(without.0.iter().any(|&v| v != 0));
    check("densify_stats", exact(&with.0, &without.0));
    assert_ne!(with.1, without.1, "the label loss reaches the parameters");
}

/// Colours are those of `sh0`; labels are given.
fn drawn(rows: &[Row], labels: Vec<u32>, width: u32, height: u32, label_map: Vec<u32>) -> Scene {
    let pixels = (width * height) as usize;
    let objects: std::collections::BTreeSet<u32> =
        label_map.iter().chain(&labels).copied().filter(|&id| id > 0).collect();
    Scene {
        frozen: 0,
        camera: plain_camera(width, height),
        gaussians: Model { rows: rows.to_vec(), labels, sh_degree: 0 }.gaussians(),
        target: Target {
            photo: Photo {
                size: (width as usize, height as usize),
                colours: vec![[f64::from(128.0_f32 / 255.0); 3]; pixels],
                valid: vec![true; pixels],
            },
            label_map,
            slots: objects.iter().map(|&label| ObjectPixel { label, occluders: Vec::new(), weight: 1.0 }).collect(),
            background: [0.0; 3],
        },
    }
}

const SIDE: u32 = 17;
/// Index of the pixel that holds the dots' centre.
pub(super) const MIDDLE: usize = 8 * 17 + 8;

/// Dots one behind the other at the middle of a picture that is all object 7.
pub(super) fn on_a_ray(opacities: &[f64]) -> Scene {
    let camera = plain_camera(SIDE, SIDE);
    let rows: Vec<Row> =
        opacities.iter().enumerate().map(|(i, &o)| dot(&camera, [8.5, 8.5], 5.0 + i as f64, 3.0, o)).collect();
    drawn(&rows, vec![0; rows.len()], SIDE, SIDE, vec![7; (SIDE * SIDE) as usize])
}

/// method.md check 1.
#[test]
fn the_nearer_of_two_gaussians_on_a_ray_is_main() {
    for (opacities, weight, labels) in [([0.7, 0.9], 0.7, [7, 0]), ([0.5, 0.999], 0.5, [0, 0])] {
        let Some(turn) = device() else { return };
        let mut fixture = Fixture::new(turn, on_a_ray(&opacities), true);
        fixture.render();
        assert_eq!(fixture.get::<u32>(Buf::MAIN_GAUSSIAN, MIDDLE + 1)[MIDDLE], 0, "the near one");
        let found = f64::from(fixture.get::<[f32; 2]>(Buf::MAIN_WEIGHT_DEPTH, MIDDLE + 1)[MIDDLE][0]);
        check("weight", close(&[found], &[weight], Tolerance { absolute: 1e-6, relative: 0.0 }));
        fixture.train();
        assert_eq!(fixture.get::<u32>(Buf::LABELS, 2), labels);
    }
}

/// method.md check 2: the transmittance behind two saturated splats is too low, so the ray stops before the second.
#[test]
fn two_saturated_splats_stop_the_ray() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, on_a_ray(&[0.9999, 0.9999, 0.5]), false);
    fixture.train();
    assert_eq!(fixture.get::<u32>(Buf::LAST, MIDDLE + 1)[MIDDLE], 1);
    assert_eq!(fixture.get::<[f32; 4]>(Buf::IMAGE, MIDDLE + 1)[MIDDLE][3], 1.0 - 0.99_f32);
}

/// method.md check 3.
#[test]
fn a_pixel_without_a_splat_has_no_main_gaussian() {
    let Some(turn) = device() else { return };
    let camera = plain_camera(SIDE, SIDE);
    let mut s = drawn(&[dot(&camera, [2.5, 2.5], 5.0, 0.5, 0.9)], vec![0], SIDE, SIDE, vec![7; 289]);
    s.target.background = [0.25, 0.5, 0.75];
    let mut fixture = Fixture::new(turn, s, false);
    fixture.render();
    assert_eq!(fixture.get::<i32>(Buf::MAIN_GAUSSIAN, 289)[MIDDLE], -1);
    assert_eq!(fixture.get::<[f32; 2]>(Buf::MAIN_WEIGHT_DEPTH, 289)[MIDDLE], [0.0, 0.0]);
    assert_eq!(fixture.get::<[f32; 4]>(Buf::IMAGE, 289)[MIDDLE], [0.25, 0.5, 0.75, 1.0]);
    assert_eq!(fixture.get::<i32>(Buf::MAIN_GAUSSIAN, 289)[2 * 17 + 2], 0);
}

/// method.md check 4: centre in mask 1, main pixels in mask 2 only.
#[test]
fn the_filter_keeps_a_gaussian_across_two_masks_unlabelled() {
    for (gpf, expected) in [(true, 0), (false, 2)] {
        let Some(turn) = device() else { return };
        let camera = plain_camera(48, 8);
        let rows = [dot(&camera, [7.5, 4.5], 5.0, 8.0, 0.985), dot(&camera, [10.5, 4.5], 6.0, 60.0, 0.95)];
        let mask = |x: usize| {
            if x < 14 {
                1
            } else if x >= 32 {
                2
            } else {
                0
            }
        };
        let s = drawn(&rows, vec![0, 0], 48, 8, (0..48 * 8).map(|i| mask(i % 48)).collect());
        let mut fixture = Fixture::new(turn, s, true);
        fixture.config.gpf = gpf;
        fixture.train();
        assert_eq!(fixture.get::<u32>(Buf::LABELS, 2), [1, expected], "filter {gpf}");
    }
}

/// method.md check 5, in coordinates where the first pixel reaches from 0 to 1.
#[test]
fn a_centre_beside_the_image_lifts_nothing() {
    for (x, expected) in [(0.1, 7), (-0.1, 0), (-0.7, 0)] {
        for gpf in [true, false] {
            let Some(turn) = device() else { return };
            let camera = plain_camera(SIDE, SIDE);
            let s = drawn(&[dot(&camera, [x, 8.5], 5.0, 3.0, 0.95)], vec![0], SIDE, SIDE, vec![7; 289]);
            let mut fixture = Fixture::new(turn, s, true);
            fixture.config.gpf = gpf;
            fixture.train();
            assert_eq!(fixture.get::<u32>(Buf::LABELS, 1), [expected], "centre at {x}, filter {gpf}");
        }
    }
}

/// method.md check 8: a mask without a Gaussian has a loss and no gradient.
#[test]
fn label_loss_of_an_empty_object_is_its_masked_photo_without_gradient() {
    let Some(turn) = device() else { return };
    let camera = plain_camera(SIDE, SIDE);
    let s = drawn(&[dot(&camera, [8.5, 8.5], 5.0, 3.0, 0.4)], vec![0], SIDE, SIDE, vec![7; 289]);
    let expected = s.target.photo.colours[0][0];
    let mut fixture = Fixture::new(turn, s, true);
    fixture.config.label_alpha = 0.0;
    let counters = fixture.train().counters;
    assert_eq!((counters.loss_label, counters.layer_tile_count), (0.0, 0));
    let loss = step_input::label_loss(
        &fixture.input,
        fixture.view.step_view(&fixture.scene),
        &fixture.config,
        counters.loss_label,
    );
    check("loss", close(&[loss], &[expected], Tolerance { absolute: 1e-7, relative: 0.0 }));
    let with: Vec<u32> = fixture.get(Buf::V_SPLATS, 12);
    fixture.config.label_weight = 1e6;
    fixture.train();
    check("gradient", exact(&fixture.get::<u32>(Buf::V_SPLATS, 12), &with));
}

/// method.md check 8: the picture of an object is its photo. A flat layer of opacity 0.5 over black shows half its
/// colour.
#[test]
fn label_loss_of_a_correct_object_is_0() {
    let Some(turn) = device() else { return };
    let camera = plain_camera(SIDE, SIDE);
    let mut row = dot(&camera, [8.5, 8.5], 5.0, 1e4, 0.5);
    // Degree 0 of the colour: 0.5 + C0 k = 2 * 128 / 255, so that half of it is the photo's 128 / 255.
    row.sh[0] = [(256.0 / 255.0 - 0.5) / Rules::default().sh_c0; 3];
    let mut fixture = Fixture::new(turn, drawn(&[row], vec![7], SIDE, SIDE, vec![7; 289]), true);
    fixture.config.label_alpha = 0.0; // it is half transparent
    let counters = fixture.train().counters;
    let loss = step_input::label_loss(
        &fixture.input,
        fixture.view.step_view(&fixture.scene),
        &fixture.config,
        counters.loss_label,
    );
    check("loss", close(&[loss], &[0.0], Tolerance { absolute: 1e-5, relative: 0.0 }));
}

/// method.md check 7, U_k on the device: pixels of an occluder are ignored, even where the object shows through.
#[test]
fn pixels_of_occluders_are_left_out() {
    let Some(turn) = device() else { return };
    let camera = plain_camera(SIDE, SIDE);
    let label_map: Vec<u32> = (0..289).map(|i| if i % 17 < 9 { 1 } else { 2 }).collect();
    let mut s = drawn(&[dot(&camera, [12.5, 8.5], 5.0, 0.4, 0.9)], vec![1], SIDE, SIDE, label_map);
    s.target.slots[0].occluders = vec![2];
    let mut fixture = Fixture::new(turn, s, true);
    fixture.config.label_threshold = 0.99; // the label stays
    let counters = fixture.train().counters;
    assert!(counters.layer_tile_count > 0 && counters.loss_label == 0.0);
    let with: Vec<u32> = fixture.get(Buf::V_SPLATS, 12);
    fixture.config.label_weight = 0.0;
    fixture.train();
    check("gradient", exact(&fixture.get::<u32>(Buf::V_SPLATS, 12), &with));
    // Without the occluder the same pixels count.
    fixture.view.occluders.clear();
    fixture.config.label_weight = 1.0;
    assert!(fixture.train().counters.loss_label > 0.0);
}
