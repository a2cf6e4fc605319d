//! Labels are chosen and edited, on synthetic Gaussians and label maps.

use glam::DVec3;
use labelgs_edit::components::components;
use labelgs_edit::rename::{give_name, keep, renumber, split};
use labelgs_edit::{
    Catalogue, Cleaning, CleaningCounts, Grouping, Pick, Prompt, PromptArea, SmallParts, Transform, choose, clean,
    recolour, relabel, split_components, without_specks,
};
use labelgs_files::{LabelEntry, LabelTable};
use labelgs_scene::harmonics::SH_C0;
use labelgs_scene::{Error, Gaussians, LabelMap};
use std::collections::{BTreeMap, BTreeSet};

const NO_ROTATION: [f32; 4] = [1.0, 0.0, 0.0, 0.0];

/// Gaussians of given centres, standard deviations and rotations, with label 1.
fn model(rows: &[([f32; 3], [f32; 3], [f32; 4])]) -> Gaussians {
    let count = rows.len();
    Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: rows.iter().map(|row| row.0).collect(),
        scales: rows.iter().map(|row| row.1.map(f32::ln)).collect(),
        quats: rows.iter().map(|row| row.2).collect(),
        opacities: vec![2.0; count],
        sh0: vec![[0.5, 0.0, -0.5]; count],
        sh_rest: vec![[0.25; 3]; count * 3],
        sh_degree: 1,
        labels: Some(vec![1; count]),
        label_confidence: None,
    }
}

/// Round Gaussians of standard deviation 0.3 along x. Each ellipsoid has radius 0.6, so two touch up to a distance of
/// 1.2.
fn beads(places: &[f32]) -> Gaussians {
    model(&places.iter().map(|&x| ([x, 0.0, 0.0], [0.3; 3], NO_ROTATION)).collect::<Vec<_>>())
}

/// The parts of all rows, without a bound on their size.
fn parts(model: &Gaussians, gap: f64) -> Vec<Vec<usize>> {
    let rows: Vec<usize> = (0..model.len()).collect();
    components(model, &rows, Grouping { gap, min_share: 0.0 }).expect("components").parts
}

#[test]
fn touching_gaussians_are_one_part() {
    let beads = beads(&[0.0, 1.1, 2.2, 3.5, 4.6, 20.0]);
    assert_eq!(parts(&beads, 0.0), [vec![0, 1, 2], vec![3, 4], vec![5]]);
    assert_eq!(parts(&beads, 0.05), [vec![0, 1, 2], vec![3, 4], vec![5]], "1.3 apart, 1.25 is spanned");
    assert_eq!(parts(&beads, 0.15), [vec![0, 1, 2, 3, 4], vec![5]]);
    assert_eq!(parts(&Gaussians::default(), 0.0), Vec::<Vec<usize>>::new());
}

#[test]
fn contact_depends_on_shape_and_rotation() {
    let rod = [1.0, 0.05, 0.05];
    // A quarter turn about z: the long axis is y.
    let turned = [0.5_f32.sqrt(), 0.0, 0.0, 0.5_f32.sqrt()];
    let pair = |between: [f32; 3], quat| parts(&model(&[([0.0; 3], rod, quat), (between, rod, quat)]), 0.0).len();
    // End to end the rods reach 2 + 2, side by side 0.1 + 0.1.
    assert_eq!([pair([3.9, 0.0, 0.0], NO_ROTATION), pair([4.1, 0.0, 0.0], NO_ROTATION)], [1, 2]);
    assert_eq!([pair([0.0, 0.19, 0.0], NO_ROTATION), pair([0.0, 0.21, 0.0], NO_ROTATION)], [1, 2]);
    assert_eq!([pair([0.0, 3.9, 0.0], turned), pair([3.9, 0.0, 0.0], turned)], [1, 2]);
    // A second rod across the first; its tip just touches the first one's side, or just misses it.
    let across = |y: f32| parts(&model(&[([0.0; 3], rod, NO_ROTATION), ([0.0, y, 0.0], rod, turned)]), 0.0).len();
    assert_eq!([across(2.09), across(2.11)], [1, 2]);
}

#[test]
fn a_small_part_between_large_ones_joins_them() {
    let rows = [([0.0; 3], [1.0; 3], NO_ROTATION), ([4.2, 0.0, 0.0], [1.0; 3], NO_ROTATION)];
    assert_eq!(parts(&model(&rows), 0.0).len(), 2);
    let bridge = ([2.1, 0.0, 0.0], [0.06; 3], NO_ROTATION);
    assert_eq!(parts(&model(&[rows[0], bridge, rows[1]]), 0.0).len(), 1);
}

#[test]
fn many_gaussians_at_one_place_or_in_one_plane_are_grouped() {
    let plane = |index: usize| ([0.0, (index % 20) as f32 * 0.5, (index / 20) as f32 * 0.5], [0.15; 3], NO_ROTATION);
    let mut rows: Vec<_> = (0..400).map(plane).collect();
    rows.extend(vec![([9.0; 3], [1e-4; 3], NO_ROTATION); 300]);
    let found = parts(&model(&rows), 0.0);
    assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [400, 300]);
}

/// Label 1 in parts of 4, 3 and 1; label 2 and 9 elsewhere.
fn scattered() -> Gaussians {
    let mut model = beads(&[0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0, 20.0, 30.0, 31.0]);
    model.labels = Some(vec![1, 1, 1, 1, 1, 1, 1, 1, 2, 9]);
    model
}

#[test]
fn parts_of_a_label_get_the_next_free_ids() {
    let how = Grouping { gap: 0.0, min_share: 0.2 };
    let ones = BTreeSet::from([1]);
    let run = |specks| split_components(&scattered(), &ones, &BTreeSet::from([10]), how, specks).expect("split");
    let kept = run(SmallParts::Keep);
    assert_eq!(kept.model.labels, Some(vec![1, 1, 1, 1, 11, 11, 11, 1, 2, 9]), "10 is taken by the table");
    assert_eq!((kept.ids, kept.specks), (BTreeMap::from([(1, vec![1, 11])]), 1));
    assert_eq!(run(SmallParts::Unlabel).model.labels, Some(vec![1, 1, 1, 1, 11, 11, 11, 0, 2, 9]));
    let dropped = run(SmallParts::Drop).model;
    assert_eq!(dropped.labels, Some(vec![1, 1, 1, 1, 11, 11, 11, 2, 9]));
    assert_eq!(dropped.means[7], [30.0, 0.0, 0.0]);
    // No id is free above the largest, so gaps are used.
    let full = split_components(&scattered(), &ones, &BTreeSet::from([65_535]), how, SmallParts::Keep).expect("split");
    assert_eq!(full.ids[&1], [1, 3]);
    let all: BTreeSet<u32> = (1..=65_535).collect();
    let message = split_components(&scattered(), &ones, &all, how, SmallParts::Keep).expect_err("no id").to_string();
    assert!(message.contains("no id is free"), "{message}");
}

#[test]
fn specks_are_left_out_label_by_label() {
    let how = Grouping { gap: 0.0, min_share: 0.2 };
    // The Gaussian at 20.0 is an eighth of label 1. Labels 2 and 9 have a single Gaussian each, which stays.
    assert_eq!(without_specks(&scattered(), how).expect("specks").labels, Some(vec![1, 1, 1, 1, 1, 1, 1, 2, 9]));
}

#[test]
fn colours_are_mixed_into_the_chosen_labels() {
    let mut model = beads(&[0.0, 1.0]);
    model.labels = Some(vec![1, 2]);
    let painted = recolour(&model, &BTreeSet::from([2]), [1.0, 0.5, 0.0], 1.0);
    assert_eq!((painted.sh0[0], &painted.sh_rest[..3]), (model.sh0[0], &model.sh_rest[..3]));
    let colour = painted.sh0[1].map(|value| 0.5 + SH_C0 * f64::from(value));
    assert!(colour.iter().zip([1.0, 0.5, 0.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{colour:?}");
    assert!(painted.sh_rest[3..].iter().all(|rest| *rest == [0.0; 3]));
    let quarter = recolour(&model, &BTreeSet::from([2]), [1.0, 0.5, 0.0], 0.25);
    // Colours are linear in their coefficients, so the mix is too.
    let expected = [0, 1, 2].map(|c| 0.75 * model.sh0[1][c] + 0.25 * painted.sh0[1][c]);
    assert!(quarter.sh0[1].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6));
    assert_eq!(quarter.sh_rest[3], [0.1875; 3]);
    assert_eq!(recolour(&model, &BTreeSet::from([1, 2]), [0.0; 3], 0.0), model);
}

fn entry(id: u32, name: &str, pixels: u64) -> LabelEntry {
    LabelEntry { name: Some(name.into()), pixels, views: id, ..LabelEntry::new(id) }
}

fn table() -> LabelTable {
    LabelTable::new(vec![entry(1, "cup", 10), entry(2, "saucer", 20), entry(5, "spoon", 5)])
}

fn named(table: &LabelTable) -> Vec<(u32, Option<&str>, u64, u32)> {
    table.labels.iter().map(|entry| (entry.id, entry.name.as_deref(), entry.pixels, entry.views)).collect()
}

#[test]
fn ids_change_all_at_once_and_names_follow() {
    let mut model = beads(&[0.0, 1.0, 2.0, 3.0]);
    model.labels = Some(vec![0, 1, 2, 5]);
    let swap = BTreeMap::from([(1, 2), (2, 1), (5, 0)]);
    assert_eq!(relabel(&model, &swap).labels, Some(vec![0, 2, 1, 0]));
    assert_eq!(named(&renumber(&table(), &swap)), [(1, Some("saucer"), 20, 2), (2, Some("cup"), 10, 1)]);
    let merged = renumber(&table(), &BTreeMap::from([(1, 5)]));
    assert_eq!(named(&merged), [(2, Some("saucer"), 20, 2), (5, Some("spoon"), 15, 5)], "5 keeps its name");
    let moved = renumber(&table(), &BTreeMap::from([(1, 7), (2, 7)]));
    assert_eq!(named(&moved), [(5, Some("spoon"), 5, 5), (7, Some("cup"), 30, 2)]);
    assert_eq!(named(&keep(&table(), |id| id > 1)).len(), 2);
    model.labels = None;
    assert_eq!(relabel(&model, &BTreeMap::from([(0, 4)])).labels, Some(vec![4; 4]));
}

#[test]
fn parts_are_numbered_by_name() {
    let mut table = table();
    table.labels[1].name = Some("cup 3".into());
    let parts = split(&table, &BTreeMap::from([(1, vec![1, 6, 7]), (9, vec![9, 8])]));
    let names: Vec<_> = parts.labels.iter().map(|entry| (entry.id, entry.name.as_deref())).collect();
    let expected =
        [(1, Some("cup")), (2, Some("cup 3")), (5, Some("spoon")), (6, Some("cup 2")), (7, Some("cup 4")), (8, None)];
    assert_eq!(names, expected);
}

#[test]
fn a_name_is_given_once() {
    let mut model = beads(&[0.0, 1.0]);
    model.labels = Some(vec![0, 4]);
    let known = Catalogue::new(&model, None);
    let made = give_name(&known, None, 4, "cup").expect("named");
    assert_eq!(named(&made), [(4, Some("cup"), 0, 0)]);
    assert_eq!(give_name(&known, Some(table()), 4, "tray").expect("named").id_of("tray"), Some(4));
    assert_eq!(give_name(&known, Some(table()), 2, "tray").expect("renamed").id_of("saucer"), None);
    assert!(give_name(&known, Some(table()), 4, "cup").expect_err("taken").to_string().contains("label 1"));
}

/// Labels 0, 1, 1, 3 with names for 1 and 2.
fn known() -> Catalogue {
    let mut model = beads(&[0.0, 1.0, 2.0, 3.0]);
    model.labels = Some(vec![0, 1, 1, 3]);
    Catalogue::new(&model, Some(table()))
}

#[test]
fn labels_are_found_by_id_and_name_or_all_are_told() {
    let known = known();
    let name = |name: &str| Pick::Name(name.into());
    assert_eq!(known.resolve("--labels", &[name("CUP"), Pick::Ids(3, 3)]).expect("found"), BTreeSet::from([1, 3]));
    assert_eq!(known.resolve("--labels", &[Pick::Ids(0, 1)]).expect("found"), BTreeSet::from([0, 1]));
    let all = "the model has 1 cup, 3, and 0 for the unlabelled";
    for (picks, problem) in [
        (vec![name("fork")], "no label is named fork"),
        (vec![name("saucer")], "no Gaussian has label 2 saucer"),
        (vec![Pick::Ids(3, 4)], "no Gaussian has label 4"),
        (vec![], "names no label"),
    ] {
        let error = known.resolve("--labels", &picks).expect_err(problem);
        assert!(matches!(error, Error::Usage { .. }), "{error}");
        assert_eq!(error.to_string(), format!("--labels: {problem}; {all}"));
    }
}

/// A map of 4 x 2 px: 1 1 3 0 / 1 1 3 3.
fn map() -> LabelMap {
    LabelMap { width: 4, height: 2, ids: vec![1, 1, 3, 0, 1, 1, 3, 3] }
}

fn ask(start: &[u32], prompts: &[(PromptArea, bool)]) -> labelgs_scene::Result<Vec<u32>> {
    let prompt = |(place, away): &(PromptArea, bool)| Prompt {
        argument: if *away { "--not-at" } else { "--at" },
        view: "v".into(),
        size: None,
        place: place.clone(),
        away: *away,
    };
    let prompts: Vec<Prompt> = prompts.iter().map(prompt).collect();
    let start = start.iter().copied().collect();
    choose(start, &prompts, &known(), &mut |_| Ok(map())).map(|labels| labels.into_iter().collect())
}

#[test]
fn points_and_boxes_mean_labels() {
    let point = |x, y| (PromptArea::Point(x, y), false);
    let not = |x, y| (PromptArea::Point(x, y), true);
    let boxed = |corners| (PromptArea::Box(corners), false);
    assert_eq!(ask(&[], &[point(2, 0)]).expect("chosen"), [3]);
    assert_eq!(ask(&[], &[point(2, 0), point(0, 1)]).expect("chosen"), [1, 3]);
    assert_eq!(ask(&[1], &[point(3, 1), not(0, 0)]).expect("chosen"), [3], "what is taken away stays away");
    assert_eq!(ask(&[], &[point(2, 0), not(3, 0)]).expect("chosen"), [3], "nothing is no label to take away");
    // Two of three pixels of 3, two of four of 1.
    assert_eq!(ask(&[], &[boxed([1, 0, 3, 2])]).expect("chosen"), [3]);
    assert_eq!(ask(&[], &[boxed([0, 0, 9, 9])]).expect("chosen"), [1, 3], "a box may stick out");

    let message = |prompts: &[_]| ask(&[], prompts).expect_err("refused").to_string();
    let nothing = message(&[point(3, 0)]);
    assert_eq!(nothing, "--at: no label is at 3,0; the view shows 1 cup (4 px), 3 (3 px)");
    assert!(message(&[point(4, 0)]).contains("outside the view, which has 4 x 2 px"));
    assert!(message(&[boxed([4, 0, 6, 2])]).contains("outside"));
    let half = message(&[boxed([0, 0, 1, 2])]);
    assert!(half.contains("1 cup (2 of its 4 pixels are inside)"), "{half}");
    let lost = message(&[point(0, 0), not(1, 1)]);
    assert!(lost.starts_with("not_at: leaves no label: it removes 1 cup; the model has 1 cup"), "{lost}");
}

#[test]
fn models_are_set_upright_moved_and_scaled() {
    let before = beads(&[3.0, 5.0]);
    let upright = |up: DVec3| Transform::upright(up).expect("a turn");
    for up in [DVec3::X, DVec3::Z, DVec3::Y, DVec3::NEG_Y, DVec3::new(1.0, 2.0, -0.5)] {
        assert!((upright(up) * up.normalize()).distance(DVec3::NEG_Y) < 1e-12, "{up}");
    }
    assert!(Transform::upright(DVec3::ZERO).is_err());
    let change = Transform { origin: DVec3::new(3.0, 0.0, 0.0), turn: upright(DVec3::X), scale: 2.0 };
    let after = change.apply(&before).expect("moved");
    assert!(after.world(0).length() < 1e-6 && after.world(1).distance(DVec3::new(0.0, -4.0, 0.0)) < 1e-6);
    assert!((after.scales[0][0] - 0.6_f32.ln()).abs() < 1e-6);
    assert_eq!(Transform::default().apply(&before).expect("the same"), before);
    assert!(Transform { scale: 0.0, ..Transform::default() }.apply(&before).is_err());
    // A faraway scene keeps its precision.
    let far = Gaussians { origin: DVec3::new(4e5, 5e6, 64.0), ..before.clone() };
    let back = Transform { origin: far.origin, ..Transform::default() }.apply(&far).expect("moved");
    assert_eq!(back, before);
}

#[test]
fn cleaning_drops_by_opacity_size_box_and_loneliness() {
    let places: Vec<f32> = (0..20).map(|index| 0.1 * index as f32).chain([40.0]).collect();
    let mut before = beads(&places);
    before.opacities[3] = -6.0;
    before.scales[5] = [0.1_f32.ln(), 9.0_f32.ln(), 0.1_f32.ln()];
    let kept = |how: Cleaning| {
        let (after, counts) = clean(&before, &how).expect("cleaned");
        (after.means.iter().map(|mean| mean[0]).collect::<Vec<_>>(), counts)
    };
    let without = |rows: &[usize]| {
        let rows = (0..places.len()).filter(|row| !rows.contains(row));
        rows.map(|row| places[row]).collect::<Vec<_>>()
    };
    let nothing = Cleaning::default();
    assert_eq!(kept(nothing), (without(&[]), CleaningCounts::default()));
    let how = Cleaning { min_opacity: Some(0.01), ..nothing };
    assert_eq!(kept(how), (without(&[3]), CleaningCounts { faint: 1, ..CleaningCounts::default() }));
    let how = Cleaning { max_size: Some(8.9), ..nothing };
    assert_eq!(kept(how), (without(&[5]), CleaningCounts { huge: 1, ..CleaningCounts::default() }));
    let how = Cleaning { max_gap: Some(10.0), ..nothing };
    assert_eq!(kept(how), (without(&[20]), CleaningCounts { lonely: 1, ..CleaningCounts::default() }));
    let inside = Some([DVec3::new(0.05, -1.0, -1.0), DVec3::new(2.0, 1.0, 1.0)]);
    let all = Cleaning { min_opacity: Some(0.01), max_size: Some(8.9), max_gap: Some(10.0), inside };
    assert_eq!(kept(all), (without(&[0, 3, 5, 20]), CleaningCounts { faint: 1, huge: 1, outside: 2, lonely: 0 }));
}
