//! Label rules on the mirrors: weights and thresholds, the lift, densification, the label loss, object layers.

use crate::reference::blend::{BlendedImage, Contribution, Trace, blend_backward, blend_forward, shade};
use crate::reference::densify::{Origin, Population, accumulate, densify, mark};
use crate::reference::lift::{Masks, lift, lift_resolve, pixel_of, vote_key};
use crate::reference::loss::{CONTOUR_BIT, ObjectPixel, Photo, label_loss};
use crate::reference::model::flatten;
use crate::reference::project::{project_all, project_backward};
use crate::reference::splat::Splat;
use crate::reference::step::{Target, splats_of, step};
use crate::reference::{Group, Model, Row, Rules};
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::scenes::{Shape, scene};

const BLACK_RGB: [f64; 3] = [0.0; 3];
const EQUAL_TOLERANCE: Tolerance = Tolerance { absolute: 1e-13, relative: 1e-10 };

/// A splat of alpha `opacity` at the middle of the only pixel.
fn on_ray(gaussian: usize, opacity: f64) -> Splat {
    let depth = 1.0 + gaussian as f64;
    Splat { gaussian, depth, mean2d: [0.5, 0.5], conic: [1.0, 0.0, 1.0], opacity, colour: [1.0; 3] }
}

fn one_pixel(opacities: &[f64]) -> BlendedImage {
    let splats: Vec<Splat> = opacities.iter().enumerate().map(|(i, &o)| on_ray(i, o)).collect();
    blend_forward(&Rules::default(), &splats, (1, 1), BLACK_RGB)
}

/// Labels after lifting label 7 from a one-pixel image.
fn lifted(image: &BlendedImage, gaussians: usize) -> Vec<u32> {
    let masks = Masks { label_map: &[7], sampled: &[7], gpf: true };
    let mut labels = vec![0; gaussians];
    lift_resolve(&lift(&Rules::default(), image, &vec![Some([0.5, 0.5]); gaussians], &masks), &mut labels);
    labels
}

#[test]
fn the_nearer_of_two_gaussians_on_a_ray_is_main() {
    let image = one_pixel(&[0.7, 0.9]);
    let pixel = &image.pixels[0];
    assert_eq!(pixel.main, 0);
    assert!((pixel.main_weight - 0.7).abs() < 1e-12 && (pixel.transmittance - 0.03).abs() < 1e-12);
    assert_eq!(lifted(&image, 2), [7, 0]);

    let image = one_pixel(&[0.5, 0.99]);
    let pixel = &image.pixels[0];
    assert_eq!(pixel.main, 0);
    assert!((pixel.margins.main - 0.01).abs() < 1e-6, "0.495 against 0.5");
    assert_eq!(lifted(&image, 2), [0, 0]);
}

#[test]
fn the_nearer_of_equal_weights_is_main() {
    let hit = |splat, alpha, transmittance| Contribution { splat, alpha, transmittance, clamped: false };
    let contributions = vec![hit(0, 0.25, 1.0), hit(1, 0.5, 0.5)];
    let ray = Trace { contributions, transmittance: 0.375, ..Trace::default() };
    let pixel = shade(&[on_ray(0, 0.25), on_ray(1, 0.5)], &ray, BLACK_RGB);
    assert_eq!((pixel.main, pixel.main_weight, pixel.margins.main), (0, 0.25, 0.0));
    // Alpha 1/3 behind alpha 0.25 has weight 0.25 too, up to rounding; the margin shows it.
    assert!(one_pixel(&[0.25, 1.0 / 3.0]).pixels[0].margins.main < 1e-7);
}

#[test]
fn two_saturated_splats_stop_as_they_do_in_f32() {
    let rest = 1.0_f32 - 0.99;
    assert!(rest * rest < 1e-4_f32, "f32 says: stop");
    let pixel = one_pixel(&[0.999, 0.999, 0.5]).pixels[0];
    assert_eq!((pixel.count, pixel.last), (1, 1));
    assert!(pixel.margins.stop < 1e-5);
    // The same constants as decimal text fall on the other side.
    let decimal = Rules { alpha_max: 0.99, transmittance_min: 1e-4, ..Rules::default() };
    let image = blend_forward(&decimal, &[on_ray(0, 0.999), on_ray(1, 0.999)], (1, 1), BLACK_RGB);
    assert_eq!(image.pixels[0].count, 2);
}

#[test]
fn a_pixel_without_a_splat_has_no_main_gaussian() {
    let image = one_pixel(&[0.0039]);
    let pixel = &image.pixels[0];
    assert_eq!((pixel.main, pixel.main_weight, pixel.count, pixel.transmittance), (-1, 0.0, 0, 1.0));
    assert_eq!(lifted(&image, 1), [0]);
    assert_eq!(one_pixel(&[0.004]).pixels[0].main, 0, "just above 1/255 counts");
}

/// A row of 48 px: mask 1 left, mask 2 right. The wide splat 1 has its centre in mask 1, but there splat 0 hides it.
fn spanning() -> (BlendedImage, Vec<Option<[f64; 2]>>, Vec<u32>) {
    let splat = |gaussian, x, sigma: f64, opacity| Splat {
        mean2d: [x, 0.5],
        conic: [sigma.powi(-2), 0.0, sigma.powi(-2)],
        ..on_ray(gaussian, opacity)
    };
    let splats = [splat(0, 7.5, 8.0, 0.985), splat(1, 10.5, 60.0, 0.95)];
    let image = blend_forward(&Rules::default(), &splats, (48, 1), BLACK_RGB);
    let label_map = (0..48)
        .map(|x| {
            if x < 14 {
                1
            } else if x >= 32 {
                2
            } else {
                0
            }
        })
        .collect();
    (image, splats.iter().map(|s| Some(s.mean2d)).collect(), label_map)
}

fn lift_spanning(sampled: &[u32], gpf: bool) -> Vec<u32> {
    let (image, centres, label_map) = spanning();
    let mut labels = vec![0; 2];
    let masks = Masks { label_map: &label_map, sampled, gpf };
    lift_resolve(&lift(&Rules::default(), &image, &centres, &masks), &mut labels);
    labels
}

#[test]
fn the_projection_filter_keeps_a_spanning_gaussian_unlabelled() {
    assert_eq!(lift_spanning(&[1, 2], true), [1, 0]);
    assert_eq!(lift_spanning(&[1, 2], false), [1, 2]);
    assert_eq!(lift_spanning(&[2], true), [0, 0], "a label that is not sampled writes nothing");
    assert_eq!(lift_spanning(&[], false), [0, 0]);
}

#[test]
fn a_centre_outside_the_image_is_never_labelled() {
    let size = (48, 1);
    assert_eq!(pixel_of([0.1, 0.5], size), Some(0));
    assert_eq!(pixel_of([-0.1, 0.5], size), None);
    assert_eq!(pixel_of([47.9, 0.9], size), Some(47));
    assert_eq!(pixel_of([48.0, 0.5], size), None);
    assert_eq!(pixel_of([f64::NAN, 0.5], size), None);
    let (image, mut centres, label_map) = spanning();
    centres[1] = Some([-0.1, 0.5]);
    for gpf in [false, true] {
        let votes = lift(&Rules::default(), &image, &centres, &Masks { label_map: &label_map, sampled: &[2], gpf });
        assert_eq!(votes.keys[1], 0);
    }
}

#[test]
fn without_the_filter_the_heavier_vote_wins_then_the_larger_label() {
    assert!(vote_key(0.9, 3) > vote_key(0.8, 60_000));
    assert!(vote_key(0.9, 60_000) > vote_key(0.9, 3));
    assert_eq!(vote_key(1.0, 65_535), u32::MAX);
    assert_eq!(vote_key(0.6, 9) & 0xFFFF, 9);
}

/// Small row kept, small row cloned, large row split, faint row removed, huge row split into children.
fn population() -> Population {
    let row = |scale: f64, opacity: f64| Row {
        scale: [scale.ln(), (scale * 0.5).ln(), (scale * 0.2).ln()],
        quat: [0.3, -0.8, 0.5, 0.2],
        opacity,
        ..Row::default()
    };
    let rows = vec![row(0.005, 1.0), row(0.005, 1.0), row(0.05, 1.0), row(0.005, -6.0), row(0.15, 1.0), row(0.3, 1.0)];
    let count = rows.len();
    let moments: Vec<Row> = (0..count).map(|i| Row { opacity: 1.0 + i as f64, ..Row::default() }).collect();
    Population {
        model: Model { rows, labels: vec![1, 2, 3, 4, 5, 6], sh_degree: 0 },
        m: moments.clone(),
        u: moments,
        gradient_sum: vec![3e-4, 9e-4, 9e-4, 0.0, 9e-4, 9e-4],
        gradient_count: vec![3.0, 3.0, 3.0, 0.0, 3.0, 3.0],
        frozen: 0,
    }
}

#[test]
fn densification_carries_labels_and_keeps_order() {
    let before = population();
    let noise = |row: usize, child: u32, axis: usize| 0.1 * (row + axis) as f64 - f64::from(child);
    let after = densify(&Rules::default(), &before, 1.0, 3001, noise);
    // The children of row 4 are 0.15 / 1.6 wide and stay; those of row 5 are 0.3 / 1.6 > 0.1 and go.
    let origins = [
        (0, Origin::Kept),
        (1, Origin::Kept),
        (1, Origin::Clone),
        (2, Origin::Child(0)),
        (2, Origin::Child(1)),
        (4, Origin::Child(0)),
        (4, Origin::Child(1)),
    ];
    check("origins", exact(&after.origins, &origins));
    check("labels", exact(&after.model.labels, &[1, 2, 2, 3, 3, 5, 5]));
    check("counts", exact(&mark(&Rules::default(), &before, 1.0, 3001), &[1, 2, 2, 0, 2, 0]));
    let moments: Vec<f64> = after.m.iter().map(|m| m.opacity).collect();
    assert_eq!(moments, [1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0], "only rows that were there keep their moments");
    assert_eq!(after.model.rows[1], after.model.rows[2], "a clone stands where its parent stands");
    let (parent, child) = (&before.model.rows[2], &after.model.rows[3]);
    assert!((parent.scale[0] - child.scale[0] - 1.6_f64.ln()).abs() < 1e-7);
    assert_eq!((parent.quat, parent.opacity, parent.sh), (child.quat, child.opacity, child.sh));

    let early = densify(&Rules::default(), &before, 1.0, 3000, noise);
    assert_eq!(early.model.labels, [1, 2, 2, 3, 3, 5, 5, 6, 6], "large rows stay until after step 3000");
}

#[test]
fn densification_counts_the_views_that_see_a_gaussian() {
    let mut all = population();
    accumulate(&mut all, &[1e-3, 2e-3, 0.0, 0.0, 0.0, 0.0], &[true, true, true, false, false, false]);
    assert_eq!(all.gradient_count, [4.0, 4.0, 4.0, 0.0, 3.0, 3.0]);
    assert_eq!(all.gradient_sum[1], 9e-4 + 2e-3);
    assert_eq!(all.gradient_sum[2..], [9e-4, 0.0, 9e-4, 9e-4]);
}

#[test]
fn label_loss_of_a_correct_object_is_0() {
    let s = scene(21, &Shape::default());
    let (photo, map, slot) = (&s.target.photo, &s.target.label_map, &s.target.slots[0]);
    let image: Vec<[f64; 3]> =
        photo.colours.iter().zip(map).map(|(c, &l)| if l == slot.label { *c } else { BLACK_RGB }).collect();
    let alphas: Vec<f64> = map.iter().map(|&l| f64::from(u8::from(l == slot.label))).collect();
    let loss = label_loss(&Rules::default(), (&image, &alphas), photo, map, slot);
    assert_eq!(loss.value, 0.0);
    assert!(loss.v_alpha.iter().all(|v| *v == 0.0));
    assert!(loss.v_image.iter().all(|v| *v == BLACK_RGB));
}

#[test]
fn pixels_near_a_contour_are_ignored_and_weights_scale() {
    let photo = Photo { size: (4, 1), colours: vec![[0.5; 3]; 4], valid: vec![true; 4] };
    let loss = |map: &[u32], weight: f64| {
        let slot = ObjectPixel { label: 1, occluders: Vec::new(), weight };
        label_loss(&Rules::default(), (&[[0.8; 3]; 4], &[0.8; 4]), &photo, map, &slot)
    };
    let (all, without) = (loss(&[1, 0, 1, 0], 1.0), loss(&[1, CONTOUR_BIT, 1 | CONTOUR_BIT, 0], 1.0));
    assert!((all.value - 2.0 * without.value).abs() < 1e-12 && without.value > 0.0);
    assert_eq!(without.v_image[1..3], [BLACK_RGB, BLACK_RGB]);
    assert!((loss(&[1, 0, 1, 0], 2.5).value - 2.5 * all.value).abs() < 1e-12);
}

#[test]
fn label_loss_of_an_empty_object_is_its_masked_photo_without_gradient() {
    let s = scene(22, &Shape::default());
    let mut model = s.model();
    model.labels.fill(0);
    let slots = vec![s.target.slots[1].clone()];
    let target = Target { slots, ..s.target.clone() };
    let out = step(&Rules::default(), &s.camera, &model, &target);
    let (photo, slot) = (&target.photo, &target.slots[0]);
    let inside = |i: &usize| photo.valid[*i] && target.label_map[*i] == slot.label;
    let sum: f64 = (0..photo.valid.len()).filter(inside).map(|i| photo.colours[i].iter().sum::<f64>()).sum();
    let pixels = (0..photo.valid.len()).filter(inside).count() as f64;
    let rules = Rules::default();
    let opacity = 3.0 * rules.label_alpha * (1.0 - rules.alpha_slack) * pixels;
    let expected = (sum + opacity) / photo.elements() * slot.weight;
    assert!(sum > 0.0 && (out.objects[0].value - expected).abs() < 1e-12);
    let without = step(&Rules::default(), &s.camera, &model, &Target { slots: Vec::new(), ..target });
    assert_eq!(out.rows, without.rows);
}

#[test]
fn occluded_and_invalid_pixels_are_ignored() {
    let photo = Photo { size: (4, 1), colours: vec![[0.5; 3]; 4], valid: vec![true, true, true, false] };
    let slot = ObjectPixel { label: 1, occluders: vec![2], weight: 1.0 };
    let rules = Rules { label_alpha: 0.5, ..Rules::default() };
    let loss = label_loss(&rules, (&[[0.8; 3]; 4], &[0.8; 4]), &photo, &[1, 2, 0, 1], &slot);
    // Mask: 0.3 off; occluder: left out; elsewhere 0.8 off; invalid: left out of the count, too. Opacity: 0.2 off,
    // within the slack, and 0.8.
    assert!((loss.value - (0.3 + 0.8 + 0.5 * (0.8 - 0.5)) / 3.0).abs() < 1e-12);
    assert_eq!(loss.v_alpha, [0.0, 0.0, 0.5 / 3.0, 0.0]);
    let v = 1.0 / 9.0;
    assert_eq!(loss.v_image, [[v; 3], BLACK_RGB, [v; 3], BLACK_RGB]);
}

#[test]
fn object_layers_equal_separate_renders() {
    let (rules, s) = (Rules::default(), scene(23, &Shape::default()));
    let (model, size) = (s.model(), (s.camera.width as usize, s.camera.height as usize));
    let out = step(&rules, &s.camera, &model, &s.target);
    let scene_only = step(&rules, &s.camera, &model, &Target { slots: Vec::new(), ..s.target.clone() });
    let mut rows = scene_only.rows.clone();
    for (place, slot) in s.target.slots.iter().enumerate() {
        let members: Vec<usize> = (0..model.rows.len()).filter(|&i| model.labels[i] == slot.label).collect();
        assert!(members.len() > 3);
        let alone = model.filtered(|i| model.labels[i] == slot.label);
        let splats = splats_of(&project_all(&rules, &s.camera, &alone));
        let image = blend_forward(&rules, &splats, size, BLACK_RGB);
        let (ours, theirs) = (out.layers[place + 1].colours(), image.colours());
        check("image", close(ours.as_flattened(), theirs.as_flattened(), EQUAL_TOLERANCE));
        let loss = label_loss(&rules, (&theirs, &image.alphas()), &s.target.photo, &s.target.label_map, slot);
        assert!((loss.value - out.objects[place].value).abs() < 1e-13 && loss.value > 0.0);
        let v = blend_backward(&rules, &splats, size, BLACK_RGB, &loss.upstream()).values;
        for (splat, v) in splats.iter().zip(&v) {
            let row = &mut rows[members[splat.gaussian]];
            *row = row.plus(&project_backward(&rules, &s.camera, &alone, splat.gaussian, v));
        }
    }
    for group in Group::ALL {
        check("gradient", close(&flatten(&out.rows, group), &flatten(&rows, group), EQUAL_TOLERANCE));
    }
    assert_ne!(out.rows, scene_only.rows);
    assert_eq!(out.gradient2d, scene_only.gradient2d, "densification does not see the label loss");
}
