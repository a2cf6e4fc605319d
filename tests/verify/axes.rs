//! Models in other axes: the record of an SPZ, the nodes of a GLB. Truth is what a Gaussian covers and what it shows
//! along each direction.

use crate::scenes::fixtures::*;
use glam::{DMat3, DQuat, DVec3};
use labelgs::edit::Transform;
use labelgs::formats::{LabelType, SpzVersion, WriteOptions, export_model, read_model, write_model};
use labelgs::reference::Rules;
use labelgs::reference::sh::basis;
use labelgs::scene::Gaussians;
use std::fs;

/// Axes by the value of the record, from 1 on, as its definition lists them.
const AXES: [&str; 16] =
    ["LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF", "LBD", "RBD", "LBU", "RBU", "LFD", "RFD", "LFU", "RFU"];

/// Our axis of a letter.
fn axis(letter: char) -> DVec3 {
    match letter {
        'R' => DVec3::X,
        'L' => DVec3::NEG_X,
        'D' => DVec3::Y,
        'U' => DVec3::NEG_Y,
        'F' => DVec3::Z,
        _ => DVec3::NEG_Z,
    }
}

/// Long and thin Gaussians whose colours depend on the direction.
fn model() -> Gaussians {
    let number = |seed: usize| ((seed * 7919 + 13) % 1000) as f32 / 1000.0 - 0.5;
    let mut g = Gaussians { sh_degree: 3, ..Gaussians::default() };
    for row in 0..6 {
        let at = |k: usize| number(40 * row + k);
        g.means.push([4.0 * at(0), 4.0 * at(1), 4.0 * at(2)]);
        g.quats.push([at(3), at(4), at(5), at(6)]);
        g.scales.push([-1.0, -3.0, -5.0]);
        g.opacities.push(1.0);
        g.sh0.push([at(7), at(8), at(9)]);
        g.sh_rest.extend((0..15).map(|k| [at(10 + k), at(26 + k), at(11 + k)]));
    }
    g
}

fn place(model: &Gaussians, row: usize) -> DVec3 {
    model.world(row)
}

fn covariance(model: &Gaussians, row: usize) -> DMat3 {
    let [w, x, y, z] = model.quats[row].map(f64::from);
    let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    let squares = DVec3::from_array(model.scales[row].map(|scale| (2.0 * f64::from(scale)).exp()));
    axes * DMat3::from_diagonal(squares) * axes.transpose()
}

fn colour(model: &Gaussians, row: usize, along: DVec3) -> f64 {
    let values = basis(&Rules::default(), along);
    model.sh_rest[row * 15..(row + 1) * 15]
        .iter()
        .zip(&values[1..])
        .map(|(rest, value)| f64::from(rest[0]) * value)
        .sum()
}

/// Fails if `after` is not `before` moved by a matrix and then by a vector.
#[track_caller]
fn moved(before: &Gaussians, after: &Gaussians, (matrix, by): (DMat3, DVec3), what: &str) {
    assert_eq!(before.len(), after.len(), "{what}");
    let scale = matrix.determinant().abs().cbrt();
    for row in 0..before.len() {
        let off = (matrix * place(before, row) + by - place(after, row)).length();
        assert!(off < 1e-4, "{what}: place {row} is off by {off}");
        let off = matrix * covariance(before, row) * matrix.transpose() - covariance(after, row);
        let off = off.to_cols_array().iter().map(|v| v.abs()).fold(0.0, f64::max);
        assert!(off < 1e-4 * scale * scale, "{what}: ellipsoid {row} is off by {off}");
        for along in [DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.6, 0.64), DVec3::new(0.0, -1.0, 0.0)] {
            let off = (colour(before, row, along) - colour(after, row, matrix * along / scale)).abs();
            assert!(off < 1e-4, "{what}: colour {row} is off by {off}");
        }
    }
}

#[test]
fn the_axes_that_an_spz_names_are_obeyed() {
    let scene = Scene::new();
    let options = WriteOptions { spz_version: SpzVersion::V4, label_type: LabelType::None, ..WriteOptions::default() };
    export_model(scene.at("a.spz"), &model(), None, options).expect("written");
    let bytes = fs::read(scene.at("a.spz")).expect("bytes");
    let before = read_model(scene.at("a.spz")).expect("read").gaussians;
    let with = |value: u32, kind: u32| {
        let mut bytes = bytes.clone();
        bytes[14] |= 2;
        bytes[16] += 12;
        let record = [kind, 4, value].map(u32::to_le_bytes).concat();
        bytes.splice(32..32, record);
        read_model(scene.write("b.spz", bytes)).expect("read")
    };
    let matrix = |letters: &str| {
        let axes: Vec<DVec3> = letters.chars().map(axis).collect();
        DMat3::from_cols(axes[0], axes[1], axes[2])
    };
    let stored = matrix("RUB");
    for (value, letters) in (1..).zip(AXES) {
        let read = with(value, 0xADBE_0003);
        assert_eq!(read.notes, Vec::<String>::new(), "{letters}");
        moved(&before, &read.gaussians, (matrix(letters) * stored.transpose(), DVec3::ZERO), letters);
    }
    assert_eq!(with(0, 0xADBE_0003).gaussians, before);
    for (value, kind, word) in [(17, 0xADBE_0003, "right, up, back"), (1, 0xADBE_0009, "0xadbe0009")] {
        let read = with(value, kind);
        assert_eq!(read.gaussians, before);
        assert!(read.notes.len() == 1 && read.notes[0].contains(word), "{:?}", read.notes);
    }
}

/// Nodes turn, scale and move, within each other; a mesh may be shown twice.
#[test]
fn the_nodes_of_a_glb_place_its_gaussians() {
    let scene = Scene::new();
    write_model(scene.at("a.glb"), &model()).expect("written");
    let bytes = fs::read(scene.at("a.glb")).expect("bytes");
    let before = read_model(scene.at("a.glb")).expect("read").gaussians;
    let with = |nodes: &str, roots: &str| {
        let length = u32::from_le_bytes(bytes[12..16].try_into().expect("4 bytes")) as usize;
        let mut root: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
        root["nodes"] = serde_json::from_str(nodes).expect("nodes");
        root["scenes"] =
            serde_json::json!([{ "nodes": serde_json::from_str::<serde_json::Value>(roots).expect("roots") }]);
        let mut text = serde_json::to_vec(&root).expect("JSON");
        text.resize(text.len().next_multiple_of(8) + 4, b' ');
        let mut to = bytes[..8].to_vec();
        to.extend(((bytes.len() - length + text.len()) as u32).to_le_bytes());
        to.extend((text.len() as u32).to_le_bytes());
        to.extend(b"JSON");
        to.extend(text);
        to.extend(&bytes[20 + length..]);
        read_model(scene.write("b.glb", to))
    };
    // glTF has y up: x and y of our axes are negative.
    let ours = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    let turn = DQuat::from_xyzw(0.1, 0.7, -0.5, 0.5).normalize();
    let rotation = format!("[{}, {}, {}, {}]", turn.x, turn.y, turn.z, turn.w);
    let inner = format!(r#"{{"mesh": 0, "rotation": {rotation}, "scale": [3, 3, 3]}}"#);
    let nodes = format!(r#"[{{"children": [1], "translation": [1, 2, 3], "scale": [0.5, 0.5, 0.5]}}, {inner}]"#);
    let read = with(&nodes, "[0]").expect("read");
    let matrix = ours * DMat3::from_quat(turn) * 1.5 * ours;
    let by = ours * DVec3::new(1.0, 2.0, 3.0);
    moved(&before, &read.gaussians, (matrix, by), "nodes");
    assert_eq!(read.notes, Vec::<String>::new());
    // The same as a matrix by columns.
    let columns = r#"[{"mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1]}]"#;
    let read = with(columns, "[0]").expect("read");
    let quarter = DMat3::from_cols(DVec3::new(0.0, 2.0, 0.0), DVec3::new(-2.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 2.0));
    moved(&before, &read.gaussians, (ours * quarter * ours, ours * DVec3::new(5.0, 6.0, 7.0)), "a matrix");
    // Shown twice, and once outside of the scene.
    let read = with(r#"[{"mesh": 0}, {"mesh": 0, "translation": [9, 0, 0]}, {"mesh": 0}]"#, "[0, 1]").expect("read");
    assert_eq!(read.gaussians.len(), 2 * before.len());
    moved(&before, &read.gaussians.filtered(|row| row < before.len()), (DMat3::IDENTITY, DVec3::ZERO), "the first");
    let second = read.gaussians.filtered(|row| row >= before.len());
    moved(&before, &second, (DMat3::IDENTITY, DVec3::new(-9.0, 0.0, 0.0)), "the second");
    for bad in ["[1, 1, 2]", "[-1, 1, 1]", "[0, 0, 0]"] {
        let refused = refusal(with(&format!(r#"[{{"mesh": 0, "scale": {bad}}}]"#), "[0]"));
        assert!(refused.contains("b.glb: node 0: ") && refused.contains("apply its transform"), "{refused}");
    }
}

/// The colour towards each direction is turned with the model, by any turn.
#[test]
fn harmonics_are_turned_along() {
    let rules = Rules::default();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.3);
    let before = Gaussians {
        means: vec![[1.0, 2.0, 3.0]],
        quats: vec![[0.5, 0.5, -0.5, 0.5]],
        scales: vec![[0.1_f32, 0.2, 0.3].map(f32::ln)],
        opacities: vec![1.0],
        sh0: vec![[0.0; 3]],
        sh_degree: 3,
        sh_rest: (0..15).map(|k| [0.1 * k as f32 - 0.7, 0.5 - 0.07 * k as f32, (k as f32).sin()]).collect(),
        ..Gaussians::default()
    };
    let after = Transform { turn, ..Transform::default() }.apply(&before).expect("turned");
    let colour = |g: &Gaussians, direction: DVec3| {
        let values = basis(&rules, direction);
        [0, 1, 2].map(|c| (0..15).map(|k| values[k + 1] * f64::from(g.sh_rest[k][c])).sum::<f64>())
    };
    for direction in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(0.6, -0.64, 0.48), DVec3::new(-0.36, 0.48, -0.8)] {
        let (here, there) = (colour(&before, direction), colour(&after, turn * direction));
        // Coefficients are rounded to 24 bits.
        here.iter().zip(there).for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{direction}: {here:?} and {there:?}"));
    }
    // And so are places and shapes: the longest axis points where it did.
    let place = DVec3::from_array(after.means[0].map(f64::from));
    assert!(place.distance(turn * DVec3::new(1.0, 2.0, 3.0)) < 1e-6);
    let axis = |g: &Gaussians| {
        let [w, x, y, z] = g.quats[0].map(f64::from);
        DQuat::from_xyzw(x, y, z, w) * DVec3::Z
    };
    assert!(axis(&after).distance(turn * axis(&before)) < 1e-6);
}
