//! Objects are cut from a model by strokes.

use labelgs_edit::strokes::{Arcs, GraphCut, Seed, Stroke, StrokesFile, claim, smallest_cut};
use labelgs_files::label_table::LabelTable;
use labelgs_scene::Gaussians;
use labelgs_scene::harmonics::sh0_of;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The cost of a cut.
fn cost(pairs: &[[u32; 2]], rooms: &[[i32; 2]], surplus: &[i64], is_source: impl Fn(usize) -> bool) -> i64 {
    let nodes: i64 = surplus
        .iter()
        .enumerate()
        .map(|(node, &surplus)| if is_source(node) { (-surplus).max(0) } else { surplus.max(0) })
        .sum();
    let parted = |a: u32, b: u32| is_source(a as usize) && !is_source(b as usize);
    let pairs = pairs.iter().zip(rooms).map(|(&[a, b], &[there, back])| match (parted(a, b), parted(b, a)) {
        (true, _) => i64::from(there),
        (_, true) => i64::from(back),
        _ => 0,
    });
    nodes + pairs.sum::<i64>()
}

#[test]
fn a_cut_is_the_smallest_of_all() {
    let mut random = Pcg64Mcg::seed_from_u64(7);
    for round in 0..400 {
        let nodes = random.random_range(1..=11_usize);
        let all = (0..nodes as u32).flat_map(|b| (0..b).map(move |a| [a, b]));
        let pairs: Vec<[u32; 2]> = all.filter(|_| random.random_range(0..3) > 0).collect();
        // Few values, so that many paths are full at once.
        let rooms: Vec<[i32; 2]> = pairs.iter().map(|_| [0, 0].map(|_: i32| random.random_range(0..=4))).collect();
        let surplus: Vec<i64> = (0..nodes).map(|_| random.random_range(-6..=6)).collect();
        let arcs = Arcs::new(nodes, pairs.iter().copied());
        let mut room = vec![0; arcs.len()];
        for node in 0..nodes {
            for (arc, head, pair) in arcs.leaving(node) {
                room[arc] = rooms[pair][usize::from(node > head)];
            }
        }
        let side = smallest_cut(&arcs, room.clone(), surplus.clone());
        let ours = cost(&pairs, &rooms, &surplus, |node| side[node]);
        let best = (0..1_u32 << nodes)
            .map(|bits| (cost(&pairs, &rooms, &surplus, |node| bits >> node & 1 == 1), bits.count_ones()))
            .min();
        let size = side.iter().filter(|is_source| **is_source).count() as u32;
        assert_eq!(Some((ours, size)), best, "round {round}: {pairs:?} {rooms:?} {surplus:?}");
        assert_eq!(side, smallest_cut(&arcs, room, surplus), "the same again");
    }
}

/// Gaussians along a side of a sheet.
const SHEET_SIDE: usize = 24;
const RED_RGB: [f64; 3] = [0.7, 0.2, 0.15];
const GREY_RGB: [f64; 3] = [0.5, 0.5, 0.48];

/// A grey floor with noise in its colours, and on it two upright red sheets far apart.
fn room() -> Gaussians {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut model = Gaussians::default();
    let mut put = |mean: [f64; 3], scale: [f32; 3], colour: [f64; 3]| {
        model.means.push(mean.map(|value| value as f32));
        model.scales.push(scale);
        model.quats.push([1.0, 0.0, 0.0, 0.0]);
        model.opacities.push(4.0);
        model.sh0.push(colour.map(|value| sh0_of(value + random.random_range(-0.04..0.04))));
    };
    let at = |index: usize| index as f64 * 0.1;
    for (x, z) in (0..3 * SHEET_SIDE).flat_map(|x| (0..SHEET_SIDE).map(move |z| (x, z))) {
        put([at(x), 0.0, at(z)], [-3.0, -6.0, -3.0], GREY_RGB);
    }
    for (sheet, y, z) in (0..2).flat_map(|sheet| (1..9).flat_map(move |y| (6..16).map(move |z| (sheet, y, z)))) {
        put([0.5 + 5.0 * f64::from(sheet), at(y), at(z)], [-6.0, -3.0, -3.0], RED_RGB);
    }
    model
}

/// Row of a Gaussian of the floor.
fn floor(x: usize, z: usize) -> usize {
    x * SHEET_SIDE + z
}

/// Row of a Gaussian of a red sheet.
fn upright(sheet: usize, y: usize, z: usize) -> usize {
    3 * SHEET_SIDE * SHEET_SIDE + sheet * 80 + (y - 1) * 10 + z - 6
}

fn seed(row: usize, label: u32) -> Seed {
    Seed { row, label, is_on: true }
}

fn rows_of(labels: &[u32], label: u32) -> Vec<usize> {
    (0..labels.len()).filter(|&row| labels[row] == label).collect()
}

#[test]
fn strokes_make_objects_of_what_is_near_and_alike() {
    let model = room();
    let mut cutting = GraphCut::new(&model).expect("a tree");
    assert!(cutting.cut().expect("nothing to cut").iter().all(|&label| label == 0));
    let stroke: Vec<Seed> = (8..14).map(|z| seed(upright(0, 4, z), 1)).collect();
    let ground: Vec<Seed> = (20..50).map(|x| seed(floor(x, 20), 0)).collect();
    cutting.add(&stroke);
    cutting.add(&ground);
    let first = cutting.cut().expect("a cut");
    let sheet = |sheet: usize| (upright(sheet, 1, 6)..=upright(sheet, 8, 15)).collect::<Vec<usize>>();
    assert_eq!(rows_of(&first, 1), sheet(0), "the other one has the colour, and no stroke");
    assert_eq!(first, cutting.cut().expect("a cut"), "the same strokes, the same object");

    let mut known = model.clone();
    known.labels = Some((0..model.len()).map(|row| u32::from(row >= upright(1, 1, 6))).collect());
    let mut again = GraphCut::new(&known).expect("a tree");
    again.add(&stroke);
    again.add(&ground);
    let two = again.cut().expect("a cut");
    assert_eq!(rows_of(&two, 1), [sheet(0), sheet(1)].concat(), "a piece that has the label already");

    // The other sheet as a separate object.
    cutting.add(&(8..14).map(|z| seed(upright(1, 4, z), 7)).collect::<Vec<_>>());
    assert_eq!(cutting.labels(), BTreeSet::from([1, 7]));
    let both = cutting.cut().expect("a cut");
    assert_eq!((rows_of(&both, 1), rows_of(&both, 7)), (sheet(0), sheet(1)));

    // Strokes override colours.
    let off = Seed { row: upright(0, 8, 10), label: 1, is_on: false };
    cutting.add(&[off]);
    assert_ne!(cutting.cut().expect("a cut")[off.row], 1);
    cutting.add(&[Seed { is_on: true, ..off }]);
    assert_eq!(cutting.cut().expect("a cut")[off.row], 1, "the later stroke counts");
    // Another object may own what a stroke excluded from this one; here its own stroke says so.
    cutting.add(&[seed(off.row, 7), off]);
    assert_eq!(cutting.cut().expect("a cut")[off.row], 7);
    // Two objects may be excluded.
    cutting.add(&[Seed { label: 7, is_on: false, ..off }, off]);
    assert_eq!(cutting.cut().expect("a cut")[off.row], 0);
}

#[test]
fn strokes_follow_labels_that_are_there() {
    // A sheet of one colour whose left half has a label from votes.
    let mut model = Gaussians::default();
    let mut random = Pcg64Mcg::seed_from_u64(5);
    for (x, z) in (0..SHEET_SIDE).flat_map(|x| (0..SHEET_SIDE).map(move |z| (x, z))) {
        model.means.push([x as f32 * 0.1, 0.0, z as f32 * 0.1]);
        model.scales.push([-3.0, -6.0, -3.0]);
        model.quats.push([1.0, 0.0, 0.0, 0.0]);
        model.opacities.push(4.0);
        model.sh0.push(GREY_RGB.map(|value| sh0_of(value + random.random_range(-0.02..0.02))));
    }
    let is_left = |row: usize| row < SHEET_SIDE * SHEET_SIDE / 2;
    model.labels = Some((0..model.len()).map(|row| if is_left(row) { 3 } else { 0 }).collect());
    model.label_confidence = Some(vec![0.95; model.len()]);
    let mut cutting = GraphCut::new(&model).expect("a tree");
    cutting.add(&[seed(floor(4, 12), 3), seed(floor(20, 12), 0)]);
    let found = cutting.cut().expect("a cut");
    let wrong = (0..model.len()).filter(|&row| (found[row] == 3) != is_left(row)).count();
    assert_eq!(wrong, 0, "the border of the votes is kept");

    // Rows lose the strokes' labels if no object claims them; other labels stay.
    let mut other = model.clone();
    let labels = other.labels.as_mut().expect("labels");
    (labels[0], labels[1]) = (9, 3);
    let table = LabelTable::parse(Path::new("t"), br#"{"labels": [{"id": 3, "name": "left"}, {"id": 9}]}"#);
    let mut found = vec![0; model.len()];
    found[2] = 4;
    let names = BTreeMap::from([(4, "new".to_owned())]);
    let (claimed, table) =
        claim(&other, Some(table.expect("a table")), &found, &BTreeSet::from([3, 4]), &names).expect("labels");
    assert_eq!(claimed.labels.expect("labels")[..4], [9, 0, 4, 0]);
    assert_eq!(claimed.label_confidence.expect("shares")[..4], [0.95, 1.0, 1.0, 1.0]);
    assert_eq!((table.name(3), table.name(4)), (Some("left"), Some("new")));
    assert!(table.entry(9).is_some());
    let taken = BTreeMap::from([(4, "left".to_owned())]);
    assert!(claim(&other, Some(table), &found, &BTreeSet::from([4]), &taken).is_err());
}

#[test]
fn a_stroke_covers_the_pixels_of_its_line() {
    let stroke = |points: &[[f64; 2]], radius: f64| Stroke {
        view: "000".into(),
        points: points.to_vec(),
        radius,
        label: 1,
        name: None,
        on: true,
    };
    let pixels = |points: &[[f64; 2]], radius: f64| stroke(points, radius).pixels((10, 8)).expect("inside");
    assert_eq!(pixels(&[[3.7, 2.0]], 0.0), [23]);
    assert_eq!(pixels(&[[3.0, 2.0]], 1.0), [13, 22, 23, 24, 33]);
    assert_eq!(pixels(&[[2.0, 1.0], [5.0, 1.0], [5.0, 3.0]], 0.0), [12, 13, 14, 15, 25, 35]);
    assert_eq!(pixels(&[[0.0, 0.0]], 1.5), [0, 1, 10, 11], "what is outside of the photo is left out");
    // A line without gaps, from either end.
    let line = pixels(&[[9.0, 7.0], [0.0, 0.0]], 0.0);
    assert_eq!(line.len(), 10);
    assert!(line.windows(2).all(|two| two[1] % 10 == two[0] % 10 + 1 && two[1] / 10 - two[0] / 10 <= 1), "{line:?}");
    for outside in [[10.0, 0.0], [0.0, 8.0], [-0.5, 0.0], [f64::NAN, 0.0]] {
        let said = stroke(&[[1.0, 1.0], outside], 0.0).pixels((10, 8)).expect_err("outside");
        assert!(said.starts_with("point 2 (") && said.contains("10 x 8 px"), "{said}");
    }
}

#[test]
fn files_of_strokes_are_read_and_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("strokes.json");
    let read = |strokes: &str| {
        std::fs::write(&path, format!("{{\"schema_version\": 1, \"strokes\": [{strokes}]}}")).expect("a file");
        StrokesFile::read(&path)
    };
    let on = r#"{"view": "000", "points": [[10, 20], [30.5, 20]], "radius": 3, "label": 1, "name": "cup"}"#;
    let off = r#"{"view": "001.png", "points": [[1, 2]], "label": 0}"#;
    let file = read(&format!("{on}, {off}")).expect("strokes");
    assert_eq!((file.strokes[0].radius, file.strokes[0].on, file.strokes[1].radius), (3.0, true, 0.0));
    assert_eq!(file.names(&path).expect("names"), BTreeMap::from([(1, "cup".to_owned())]));
    let written = serde_json::to_string(&file).expect("JSON");
    std::fs::write(&path, written).expect("a file");
    assert_eq!(StrokesFile::read(&path).expect("what was written"), file);

    let stroke = |part: &str| on.replace(r#""radius": 3"#, part);
    for (text, expected) in [
        (on.to_owned(), "no stroke is on the background"),
        (off.to_owned(), "no stroke is on an object"),
        (format!("{on}, {}", off.replace("[[1, 2]]", "[]")), "stroke 2: has 0 points"),
        (format!("{off}, {}", stroke(r#""radius": 1e9"#)), "stroke 2: has a radius of 1000000000"),
        (format!("{off}, {}", stroke(r#""radius": -1"#)), "stroke 2: has a radius of -1"),
        (format!("{off}, {}", on.replace(r#""label": 1"#, r#""label": 4000000000"#)), "stroke 2: has label 4000000000"),
        (format!("{on}, {}", on.replace(r#""label": 1"#, r#""label": 0"#)), "stroke 2: has a name for label 0"),
        (format!("{on}, {off}, {}", on.replace("cup", "pot")), "stroke 3: calls label 1 pot"),
        (format!("{on}, {off}, {}", on.replace(r#""label": 1"#, r#""label": 2"#)), "stroke 3: calls label 2 cup"),
        (format!("{off}, {}", stroke(r#""width": 3"#)), "width"),
        (format!("{off}, {}", on.replace("[30.5, 20]", "[30.5]")), "expected {"),
    ] {
        let error = read(&text).expect_err(expected).to_string();
        assert!(error.contains("strokes.json") && error.contains(expected), "{error} has not: {expected}");
    }
    let many: Vec<String> =
        (1..300).map(|label| format!(r#"{{"view": "0", "points": [[0, 0]], "label": {label}}}"#)).collect();
    assert!(read(&many.join(", ")).expect_err("too many").to_string().contains("at most 256"));
    std::fs::write(&path, r#"{"schema_version": 2, "strokes": []}"#).expect("a file");
    assert!(StrokesFile::read(&path).is_err());
}
