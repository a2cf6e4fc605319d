//! Labels are restored to a copy from another program: sorted, thinned, rounded, merged or moved.

use glam::{DMat3, DVec3};
use labelgs_edit::{CarriedLabels, carry};
use labelgs_formats::{LabelType, WriteOptions, export_model, read_model};
use labelgs_scene::harmonics::value_of;
use labelgs_scene::{Error, Gaussians};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Balls on a table, labels 0 to 5. Each label has a colour, and each Gaussian a shade of it.
fn model() -> Gaussians {
    let mut random = Pcg64::seed_from_u64(7);
    let mut model = Gaussians { labels: Some(Vec::new()), label_confidence: Some(Vec::new()), ..Gaussians::default() };
    for label in 0..6_u32 {
        for _ in 0..150 {
            let [x, y, z] = [(); 3].map(|()| random.random_range(-1.0..1.0_f64));
            let turn = f64::from(label) * 1.2;
            let middle = 2.0 * DVec3::new(turn.cos(), turn.sin(), 0.0);
            let place = if label == 0 {
                DVec3::new(4.0 * x, 4.0 * y, -0.5)
            } else {
                middle + 0.5 * DVec3::new(x, y, z).normalize()
            };
            model.means.push(place.as_vec3().to_array());
            model.quats.push([1.0, 0.0, 0.0, 0.0]);
            model.scales.push([(); 3].map(|()| random.random_range(-5.0..-3.0)));
            model.opacities.push(random.random_range(-1.0..4.0));
            model.sh0.push([
                label as f32 * 0.4 - 1.0 + random.random_range(-0.1..0.1),
                random.random_range(-0.1..0.1),
                0.3,
            ]);
            model.labels.as_mut().expect("labels").push(label);
            model.label_confidence.as_mut().expect("shares").push(random.random_range(0.5..1.0));
        }
    }
    model
}

/// The same rows without labels, as another program writes them.
fn bare(model: &Gaussians) -> Gaussians {
    Gaussians { labels: None, label_confidence: None, ..model.clone() }
}

/// Share of a copy's rows with the label of the row of the model that each comes from.
fn right(carried: &CarriedLabels, model: &Gaussians, from: &[usize]) -> f64 {
    let is_right = |(row, &source): (usize, &usize)| carried.model.label(row) == model.label(source);
    let count = from.iter().enumerate().filter(|&pair| is_right(pair)).count();
    count as f64 / from.len() as f64
}

#[test]
fn a_sorted_part_gets_its_labels_and_confidences_bit_for_bit() {
    let model = model();
    let mut rows: Vec<usize> = (0..model.len()).filter(|row| row % 3 != 1).collect();
    rows.shuffle(&mut Pcg64::seed_from_u64(1));
    let copy = bare(&model.picked(&rows));
    let carried = carry(&copy, &model).expect("carried");
    assert_eq!((carried.same, carried.near, carried.none), (rows.len() as u64, 0, 0));
    assert_eq!(carried.model, model.picked(&rows));
    // Old labels are replaced, and a model without confidences gives none.
    let relabelled = Gaussians { labels: Some(vec![9; rows.len()]), ..copy };
    let plain = Gaussians { label_confidence: None, ..model };
    assert_eq!(carry(&relabelled, &plain).expect("carried").model, plain.picked(&rows));
}

#[test]
fn colours_may_change_where_places_stay() {
    let model = model();
    let painted = Gaussians { sh0: vec![[1.0, -1.0, 0.0]; model.len()], ..bare(&model) };
    assert_eq!(carry(&painted, &model).expect("carried").model.labels, model.labels);
}

#[test]
fn of_several_at_one_place_the_most_alike_counts() {
    let mut model = model();
    let half = model.len() / 2;
    for row in 0..half {
        model.means[half + row] = model.means[row];
    }
    let mut rows: Vec<usize> = (0..model.len()).collect();
    rows.reverse();
    let carried = carry(&bare(&model.picked(&rows)), &model).expect("carried");
    assert_eq!(carried.model.labels, model.picked(&rows).labels);
    // All at one position, more than a leaf of the tree holds.
    model.means.fill([1.0, 2.0, 3.0]);
    let carried = carry(&bare(&model.picked(&rows)), &model).expect("carried");
    assert_eq!(carried.model.labels, model.picked(&rows).labels);
}

#[test]
fn formats_round_and_labels_come_back() {
    let (model, folder) = (model(), tempfile::tempdir().expect("a folder"));
    let without = WriteOptions { label_type: LabelType::None, ..WriteOptions::default() };
    for (name, exact) in [("copy.ply", true), ("copy.spz", false), ("copy.glb", true), ("copy.sog", false)] {
        let path = folder.path().join(name);
        export_model(&path, &model, None, without).expect("written");
        let copy = read_model(&path).expect("read").gaussians;
        assert_eq!(copy.labels, None, "{name}");
        let carried = carry(&copy, &model).expect("carried");
        assert_eq!(carried.none, 0, "{name}");
        assert!(!exact || carried.near == 0, "{name}: {} are not at the same place", carried.near);
        // Some formats sort, so positions identify the rows.
        let from: Vec<usize> = copy.means.iter().map(|mean| nearest(&model, *mean)).collect();
        let share = right(&carried, &model, &from);
        assert!(share > 0.999, "{name}: {share} have the right label");
    }
}

fn nearest(model: &Gaussians, mean: [f32; 3]) -> usize {
    let distance = |row: &usize| {
        let off: [f32; 3] = std::array::from_fn(|axis| model.means[*row][axis] - mean[axis]);
        off.iter().map(|value| value * value).sum::<f32>()
    };
    (0..model.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a row")
}

/// Rounding is coarser than the space between balls, so only colours tell Gaussians around a position apart.
#[test]
fn coarse_steps_are_told_by_the_look() {
    let mut model = model();
    // Two labels in one crowd.
    let mut random = Pcg64::seed_from_u64(3);
    model.means.iter_mut().for_each(|mean| *mean = [(); 3].map(|()| random.random_range(0.0..1.0)));
    let step = 1.0 / 15.0;
    let mut copy = bare(&model);
    copy.means.iter_mut().flatten().for_each(|value| *value = (*value / step).round() * step);
    let carried = carry(&copy, &model).expect("carried");
    let all: Vec<usize> = (0..model.len()).collect();
    let share = right(&carried, &model, &all);
    let by_place =
        copy.means.iter().zip(&all).filter(|&(mean, &row)| model.label(nearest(&model, *mean)) == model.label(row));
    let nearest = by_place.count() as f64 / model.len() as f64;
    assert!(share > 0.99 && nearest < 0.96, "{share} are right, {nearest} by the nearest place alone");
}

/// A .splat stores positions as floats, and colour and opacity as bytes.
#[test]
fn a_splat_gets_its_labels() {
    let (model, folder) = (model(), tempfile::tempdir().expect("a folder"));
    let mut bytes = Vec::new();
    for row in (0..model.len()).rev() {
        let floats = model.means[row].into_iter().chain(model.scales[row].map(f32::exp));
        bytes.extend(floats.flat_map(f32::to_le_bytes));
        let colour = model.sh0[row].map(|value| value_of(value).clamp(0.0, 1.0));
        bytes.extend(colour.into_iter().chain([model.opacity(row)]).map(|value| (255.0 * value).round() as u8));
        bytes.extend([255, 128, 128, 128]);
    }
    let path = folder.path().join("copy.splat");
    std::fs::write(&path, bytes).expect("written");
    let carried = carry(&read_model(&path).expect("read").gaussians, &model).expect("carried");
    let backwards: Vec<usize> = (0..model.len()).rev().collect();
    assert_eq!((carried.same, &carried.model.labels), (model.len() as u64, &model.picked(&backwards).labels));
}

#[test]
fn merged_pairs_get_the_label_of_both() {
    let model = model();
    let weights = vec![1.0; model.len()];
    let mut simplifier = labelgs_edit::Simplifier::new(&model, &weights);
    simplifier.reduce_to(model.len() / 2).expect("merged");
    let few = simplifier.model();
    let carried = carry(&bare(&few), &model).expect("carried");
    let all: Vec<usize> = (0..few.len()).collect();
    let share = right(&carried, &few, &all);
    assert!(share > 0.97, "{share} of the merged have the right label, {} none", carried.none);
}

#[test]
fn what_was_added_has_no_label() {
    let model = model();
    let mut copy = bare(&model);
    let mut other = bare(&model.filtered(|row| row < 100));
    other.means.iter_mut().for_each(|mean| mean[2] += 7.0);
    copy.append(other);
    let carried = carry(&copy, &model).expect("carried");
    assert_eq!((carried.same, carried.near, carried.none), (model.len() as u64, 0, 100));
    let labels = carried.model.labels.expect("labels");
    assert_eq!(Some(&labels[..model.len()]), model.labels.as_deref());
    assert!(labels[model.len()..].iter().all(|&label| label == 0));
}

#[test]
fn a_moved_copy_is_refused() {
    let model = model();
    let turn = DMat3::from_rotation_x(0.7);
    let changes: [(&str, &dyn Fn(DVec3) -> DVec3); 3] = [
        ("moved", &|at| at + DVec3::new(0.6, 0.3, 0.9)),
        ("turned", &|at| turn * at),
        ("scaled", &|at| 3.0 * (at + DVec3::Z)),
    ];
    for (name, change) in changes {
        let mut copy = bare(&model);
        for mean in &mut copy.means {
            *mean = change(DVec3::from_array(mean.map(f64::from))).as_vec3().to_array();
        }
        let error = carry(&copy, &model).expect_err(name);
        assert!(matches!(error, Error::Usage { .. }), "{name}: {error}");
        let text = error.to_string();
        assert!(text.contains("of 900 Gaussians of the copy") && text.contains("looks moved"), "{name}: {text}");
    }
}

/// Programs drop the origin of a faraway scene, or move the scene.
#[test]
fn the_origin_may_be_lost_or_another() {
    let far = Gaussians { origin: DVec3::new(5e5, 4e6, 100.0), ..model() };
    let lost = Gaussians { origin: DVec3::ZERO, ..bare(&far) };
    let carried = carry(&lost, &far).expect("carried");
    assert_eq!((carried.same, &carried.model.labels), (far.len() as u64, &far.labels));
    let mut other = Gaussians { origin: far.origin + DVec3::X, ..bare(&far) };
    other.means.iter_mut().for_each(|mean| mean[0] -= 1.0);
    let carried = carry(&other, &far).expect("carried");
    assert_eq!((carried.none, &carried.model.labels), (0, &far.labels));
}

#[test]
fn values_that_are_not_finite_find_nothing() {
    let mut model = model();
    let mut copy = bare(&model);
    copy.means[5][0] = f32::NAN;
    model.means[6][1] = f32::INFINITY;
    let carried = carry(&copy, &model).expect("carried");
    assert_eq!(carried.model.label(5), 0);
    model.means.fill([f32::NAN; 3]);
    let error = carry(&copy, &model).expect_err("nothing to find");
    assert!(error.to_string().contains("no Gaussian with finite values"), "{error}");
}
