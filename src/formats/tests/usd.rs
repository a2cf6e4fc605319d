//! USD: layers of labelgs, layers of other programs, and damaged ones.

use super::fixtures::*;
use super::models::model;
use glam::{DMat3, DQuat, DVec3};
use labelgs_files::{LabelEntry, LabelTable};
use labelgs_formats::{WriteOptions, export_model, read_model, write_model};
use labelgs_scene::Gaussians;
use labelgs_scene::harmonics::basis;
use std::fs;

/// A stage as a person may write it: z up, a prim in a rotated group, 16-bit floats, comments, a prim of another kind,
/// and one that is switched off.
const FOREIGN_STAGE: &str = include_str!("golden/foreign.usda");

/// The squared size of a Gaussian along each axis.
fn squares(model: &Gaussians, row: usize) -> DVec3 {
    let [w, x, y, z] = model.quats[row].map(f64::from);
    let sizes = model.scales[row].map(|scale| f64::from(scale).exp());
    let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize()) * DMat3::from_diagonal(sizes.into());
    let covariance = axes * axes.transpose();
    DVec3::new(covariance.x_axis.x, covariance.y_axis.y, covariance.z_axis.z)
}

#[test]
fn a_stage_of_another_program_is_read_at_its_place() {
    let scene = Scene::new();
    let read = read_model(scene.write("a.usda", FOREIGN_STAGE)).expect("read");
    let g = &read.gaussians;
    assert_eq!((g.len(), g.sh_degree), (3, 1));
    // (x, y, z) with z up is (x, z, -y) with y up, and our y and z point the other way.
    let ours = |x: f64, y: f64, z: f64| DVec3::new(x, -z, y);
    // Scaled by 2, turned about x, then about z, and moved twice.
    for (row, expected) in [(0, ours(11.0, 2.0, 3.0)), (1, ours(14.0, 5.0, 6.0)), (2, ours(10.0, 2.0, 100.0))] {
        assert!(g.world(row).distance(expected) < 1e-4, "{row}: {} and {expected}", g.world(row));
    }
    assert!(squares(g, 0).distance(DVec3::new(1.0, 9.0, 4.0)) < 1e-4, "{}", squares(g, 0));
    assert!(squares(g, 2).distance(DVec3::splat(4.0)) < 1e-4, "{}", squares(g, 2));
    assert!(g.opacities[0].abs() < 1e-6 && g.opacities[1] > 10.0 && g.opacities[2] > 10.0, "{:?}", g.opacities);
    // The colour from a direction is the same.
    let red = |rest: &[[f32; 3]], direction: DVec3| -> f64 {
        rest.iter().zip(basis(direction)).map(|(triple, value)| f64::from(triple[0]) * value).sum()
    };
    let direction = DVec3::new(0.6, 0.3, 0.74).normalize();
    let expected = red(&[[0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]], direction);
    let found = red(g.rest(0), ours(direction.x, direction.y, direction.z));
    assert!(expected.abs() > 0.01 && (found - expected).abs() < 1e-6, "{found} and {expected}");
    // The semantic label of a prim or of a prim around it becomes a label.
    assert_eq!(g.labels, Some(vec![1, 1, 2]));
    let names = read.names.expect("names");
    assert_eq!([names.name(1), names.name(2)], [Some("table"), Some("lamp \"A\"")]);
    let notes = read.notes.join("; ");
    assert!(notes.contains("switched off") && notes.contains("references were omitted"), "{notes}");
    // A package of the layer reads the same.
    let mut zip = zip_of(&[("textures/a.png", b"x".to_vec()), ("World.USDA", FOREIGN_STAGE.into())]);
    assert_eq!(read_model(scene.write("a.usdz", &zip)).expect("read").gaussians, *g);
    zip = zip_of(&[("a.usdc", b"PXR-USDC\0\x08".to_vec())]);
    let refused = refusal(read_model(scene.write("b.usdz", &zip)));
    assert!(refused.contains("a.usdc: is a binary USD layer") && refused.contains("usdcat"), "{refused}");
    for name in ["b.usdc", "b.usd", "b.usda"] {
        let refused = refusal(read_model(scene.write(name, b"PXR-USDC\0\x08\xFF")));
        assert!(refused.contains("is a binary USD layer") && refused.contains("usdcat"), "{name}: {refused}");
    }
}

/// An archive of uncompressed files.
fn zip_of(files: &[(&str, Vec<u8>)]) -> Vec<u8> {
    use std::io::Write;
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in files {
        zip.start_file(*name, stored).expect("a file");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("finished").into_inner()
}

/// Each label is a prim with its name, and its bounding box contains its Gaussians.
#[test]
fn each_label_is_a_prim() {
    let scene = Scene::new();
    let entry = |id, name: &str| LabelEntry { name: Some(name.into()), ..LabelEntry::new(id) };
    let names = LabelTable::new(vec![entry(3, "3 \"Krüge\"\\")]);
    let mut before = model(40, 1, true);
    // A single one, turned by a quarter about z: its size along y is that of its first axis.
    let alone = before.labels.as_ref().and_then(|labels| labels.iter().position(|&label| label == 700)).expect("a row");
    before = before.filtered(|row| row % 4 != 3 || row == alone);
    before.means[alone] = [1.0, 2.0, 3.0];
    before.quats[alone] = [1.0, 0.0, 0.0, 1.0];
    before.scales[alone] = [2.0_f32.ln(), 0.5_f32.ln(), 0.0];
    export_model(scene.at("a.usda"), &before, Some(&names), WriteOptions::default()).expect("written");
    let text = fs::read_to_string(scene.at("a.usda")).expect("text");
    for part in [
        "#usda 1.0\n",
        "metersPerUnit = 1\n",
        "upAxis = \"Y\"\n",
        "def ParticleField3DGaussianSplat \"gaussians\" (",
        "def ParticleField3DGaussianSplat \"_3__Kr_ge___3\" (",
        "def ParticleField3DGaussianSplat \"label_700\" (",
        "semantics:labels:class = [\"3 \\\"Krüge\\\"\\\\\"]",
        "semantics:labels:class = [\"label_700\"]",
        "uniform int radiance:sphericalHarmonicsDegree = 3\n",
    ] {
        assert!(text.contains(part), "{part}");
    }
    assert_eq!(text.matches("def ParticleField3DGaussianSplat").count(), 3);
    let (_, own) = text.split_once("\"label_700\"").expect("the prim");
    let (_, extent) = own.split_once("extent = ").expect("an extent");
    let numbers: Vec<f32> = extent
        .lines()
        .next()
        .expect("a line")
        .split([' ', ',', '(', ')', '[', ']'])
        .filter_map(|word| word.parse().ok())
        .collect();
    let expected = [1.0 - 1.5, -2.0 - 6.0, -3.0 - 3.0, 1.0 + 1.5, -2.0 + 6.0, -3.0 + 3.0];
    assert_eq!(numbers.len(), 6, "{numbers:?}");
    assert!(numbers.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{numbers:?}");
    let read = read_model(scene.at("a.usda")).expect("read").names.expect("names");
    assert_eq!((read.name(3), read.name(700)), (Some("3 \"Krüge\"\\"), None));
    // Without a name, the label is not one.
    let error = write_model(scene.at("none.usda"), &Gaussians::default()).expect_err("nothing to show").to_string();
    assert!(error.contains("no Gaussians") && !scene.at("none.usda").exists(), "{error}");
}

/// Readers map the files of a package into memory: they are uncompressed and aligned to 64 bytes.
#[test]
fn files_of_a_package_are_aligned() {
    let scene = Scene::new();
    write_model(scene.at("a.usdz"), &model(5, 3, true)).expect("written");
    let bytes = fs::read(scene.at("a.usdz")).expect("bytes");
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(&bytes)).expect("an archive");
    assert_eq!(zip.len(), 1);
    let entry = zip.by_index(0).expect("a file");
    assert_eq!(
        (entry.compression(), entry.data_start().map(|start| start % 64)),
        (zip::CompressionMethod::Stored, Some(0))
    );
    let start = entry.data_start().expect("a start") as usize;
    assert!(bytes[start..].starts_with(b"#usda 1.0\n"));
}

#[test]
fn damaged_layers_are_refused_by_their_line() {
    let scene = Scene::new();
    let prim = "#usda 1.0\ndef ParticleField3DGaussianSplat \"a\" {\npoint3f[] positions = [(1, 2, 3), (4, 5, 6)]\n";
    let deep = format!("#usda 1.0\n{}", "def \"a\" {\n".repeat(300));
    let cases: [(String, &[&str]); 17] = [
        ("#usdb".into(), &["a.usda: line 1: ", "not a USD text layer"]),
        ("#usda 1.0\n".into(), &["a.usda: no prim is a ParticleField3DGaussianSplat"]),
        ("#usda 1.0\n(subLayers = [@b.usda@])".into(), &["no prim is", "its subLayers were omitted"]),
        (prim.into(), &["a.usda: line 2: ", "\"a\" has no end"]),
        (format!("{prim}}}}}"), &["a.usda: line 4: ", "closes nothing"]),
        (format!("{prim}float[] opacities = [0.5]\n}}"), &["line 4: ", "opacities has 1 numbers; 2 positions need 2"]),
        (format!("{prim}float[] opacities = [0.5, x]\n}}"), &["line 4: ", "expected a number, found `x`"]),
        (format!("{prim}float[] opacities = [0.5, \"1\"]\n}}"), &["line 4: ", "expected a number, found `\"1\"]`"]),
        (format!("{prim}float[] opacities = [0.5, 1\n}}"), &["line 5: ", "`}` closes nothing"]),
        (format!("{prim}string a = \"b\n}}"), &["line 4: ", "string that does not end on its line"]),
        (format!("{prim}string a = \"\"\"b\n}}"), &["line 4: ", "unterminated string"]),
        (prim.replace("positions", "points") + "}", &["line 2: ", "has no static positions"]),
        (prim.replace(", 6", "") + "}", &["line 3: ", "not triples"]),
        (
            format!(
                "{prim}int radiance:sphericalHarmonicsDegree = 4\nfloat3[] radiance:sphericalHarmonicsCoefficients = []}}"
            ),
            &["line 4: ", "degree 4"],
        ),
        (
            format!("{prim}double3 xformOp:scale = (1, 2, 1)\ntoken[] xformOpOrder = [\"xformOp:scale\"]\n}}"),
            &["line 2: ", "different factors per axis"],
        ),
        (
            format!("{prim}token[] xformOpOrder = [\"xformOp:scale\"]\n}}"),
            &["line 2: ", "xformOp:scale, which has no value"],
        ),
        (deep, &["line 258: ", "deeper than 256"]),
    ];
    for (text, expected) in cases {
        let error = refusal(read_model(scene.write("a.usda", &text)));
        println!("{}", error.replace(&format!("{}/", scene.path().display()), ""));
        assert!(expected.iter().all(|part| error.contains(part)), "{error}");
    }
    let zip = zip_of(&[("m.usda", format!("{prim}float[] opacities = [0.5]\n}}").into_bytes())]);
    assert!(refusal(read_model(scene.write("a.usdz", zip))).contains("a.usdz: m.usda, line 4: "));
    assert!(refusal(read_model(scene.write("a.usdz", zip_of(&[("a.txt", Vec::new())])))).contains("has no layer"));
    let own = "customData = { dictionary labelgs = { int label = -1 } }";
    let text = prim.replace("\"a\"", &format!("\"a\" ({own})")) + "}";
    assert!(refusal(read_model(scene.write("a.usda", text))).contains("line 2: the label is not a whole number"));
}
