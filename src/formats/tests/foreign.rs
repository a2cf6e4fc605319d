//! PLY models of other trainers and programs: columns, labels and headers, and files that are not PLY.

use super::fixtures::*;
use labelgs_formats::{ReadModel, read_model, write_model};
use std::fs;

/// The columns of a 3DGS PLY of degree 0, and values of a row.
const PLAIN_COLUMNS: [(&str, f64); 14] = [
    ("x", 1.0),
    ("y", 2.0),
    ("z", 3.0),
    ("f_dc_0", 0.25),
    ("f_dc_1", 0.5),
    ("f_dc_2", 0.75),
    ("opacity", 1.5),
    ("scale_0", -2.0),
    ("scale_1", -1.0),
    ("scale_2", -3.0),
    ("rot_0", 1.0),
    ("rot_1", 0.0),
    ("rot_2", 0.0),
    ("rot_3", 0.0),
];

/// An ascii PLY with one row for each entry of `last`, the values of the last column.
fn ply(columns: &[(&str, f64)], last: &[f64]) -> String {
    let properties: String = columns.iter().map(|(name, _)| format!("property float {name}\n")).collect();
    let head: String = columns[..columns.len() - 1].iter().map(|(_, value)| format!("{value} ")).collect();
    let rows: String = last.iter().map(|value| format!("{head}{value}\n")).collect();
    format!("ply\nformat ascii 1.0\ncomment x\nelement vertex {}\n{properties}end_header\n{rows}", last.len())
}

/// The plain columns and additional ones.
fn with(more: &[(&'static str, f64)]) -> Vec<(&'static str, f64)> {
    PLAIN_COLUMNS.iter().chain(more).copied().collect()
}

fn read(columns: &[(&str, f64)]) -> ReadModel {
    let last = columns.last().expect("a column").1;
    read_model(Scene::new().write("a.ply", ply(columns, &[last]))).expect("read")
}

fn without(name: &str) -> Vec<(&'static str, f64)> {
    PLAIN_COLUMNS.into_iter().filter(|column| column.0 != name).collect()
}

/// Squared sizes add up, and the opacity falls by the ratio of the volumes.
#[test]
fn the_filter_of_mip_splatting_is_applied() {
    let filter = 0.2_f64;
    let ReadModel { gaussians, notes, .. } = read(&with(&[("filter_3D", filter)]));
    let sizes = [-2.0_f64, -1.0, -3.0].map(f64::exp);
    let larger = sizes.map(|size| (size * size + filter * filter).sqrt());
    let share =
        sizes.iter().zip(larger).map(|(size, larger)| size / larger).product::<f64>() / (1.0 + (-1.5_f64).exp());
    for (found, expected) in gaussians.scales[0].iter().zip(larger) {
        assert!((f64::from(*found) - expected.ln()).abs() < 1e-6, "{found} and {expected}");
    }
    assert!((f64::from(gaussians.opacities[0]) - (share / (1.0 - share)).ln()).abs() < 1e-6);
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("`filter_3D`"), "{notes:?}");
    // A filter of 0 changes nothing, and the smallest Gaussian remains drawable.
    assert_eq!(read(&with(&[("filter_3D", 0.0)])).gaussians, read(&PLAIN_COLUMNS).gaussians);
    let mut tiny = with(&[("filter_3D", 1e6)]);
    tiny[7].1 = -40.0;
    assert_eq!(read(&tiny).dropped, 0);
}

#[test]
fn discs_of_2dgs_get_a_thin_axis() {
    let ReadModel { gaussians, notes, .. } = read(&without("scale_2"));
    assert_eq!(gaussians.scales, [[-2.0, -1.0, 1e-6_f32.ln()]]);
    assert!(notes.len() == 1 && notes[0].contains("`scale_2`") && notes[0].contains("2DGS"), "{notes:?}");
}

#[test]
fn prefixes_of_cloudcompare_are_dropped() {
    let expected = read(&with(&[("label", 7.0)])).gaussians;
    for prefix in ["scalar_", "scalar_scal_"] {
        let named: Vec<(String, f64)> = with(&[("label", 7.0)])
            .into_iter()
            .enumerate()
            .map(|(at, (name, value))| (if at < 3 { name.to_owned() } else { format!("{prefix}{name}") }, value))
            .collect();
        let named: Vec<(&str, f64)> = named.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let found = read(&named);
        assert_eq!((found.gaussians, found.notes), (expected.clone(), Vec::new()), "{prefix}");
    }
}

#[test]
fn harmonics_of_degree_4_are_left_out() {
    let names: Vec<String> = (0..72).map(|index| format!("f_rest_{index}")).collect();
    let mut columns: Vec<(&str, f64)> = PLAIN_COLUMNS.to_vec();
    columns.extend(names.iter().enumerate().map(|(index, name)| (name.as_str(), index as f64)));
    let ReadModel { gaussians, notes, .. } = read(&columns);
    let expected: Vec<[f32; 3]> = (0..15).map(|k| [k as f32, (24 + k) as f32, (48 + k) as f32]).collect();
    assert_eq!((gaussians.sh_degree, gaussians.sh_rest), (3, expected));
    assert_eq!(notes, ["harmonics of degree 4 were omitted; labelgs supports up to degree 3"]);
    let refused = refusal(read_model(Scene::new().write("a.ply", ply(&columns[..20], &[0.0]))));
    assert!(refused.contains("6 `f_rest_` properties") && refused.contains("export it"), "{refused}");
}

/// Columns that may change renders are named once; harmless columns are not named.
#[test]
fn columns_that_are_not_read_are_named() {
    let lobes = [("sg_axis_0", 1.0), ("sg_axis_1", 1.0), ("sg_sharpness_0", 2.0), ("beta", 0.5)];
    let notes = read(&with(&lobes)).notes;
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("the columns beta, sg_axis_*, sg_sharpness_* were not read"), "{notes:?}");
    let harmless = [("nx", 0.0), ("ny", 0.0), ("nz", 1.0), ("red", 1.0), ("obj_dc_0", 3.0), ("id", 4.0)];
    assert_eq!(read(&with(&harmless)).notes, Vec::<String>::new());
    // Anchors of a network are not Gaussians.
    let mut anchors: Vec<(&str, f64)> =
        PLAIN_COLUMNS.into_iter().filter(|(name, _)| !name.starts_with("f_dc")).collect();
    anchors.push(("f_anchor_feat_0", 0.0));
    let refused = refusal(read_model(Scene::new().write("a.ply", ply(&anchors, &[0.0]))));
    assert!(refused.contains("Scaffold-GS") && refused.contains("export"), "{refused}");
    let refused = refusal(read_model(Scene::new().write("a.ply", ply(&without("opacity"), &[0.0]))));
    assert!(refused.contains("lacks the properties opacity; export it"), "{refused}");
}

#[test]
fn colours_instead_of_harmonics_are_read() {
    let colours = [("red", 255.0), ("green", 0.0), ("blue", 51.0)];
    let columns: Vec<(&str, f64)> =
        PLAIN_COLUMNS.into_iter().filter(|(name, _)| !name.starts_with("f_dc")).chain(colours).collect();
    let text = ply(&columns, &[51.0]);
    let bytes = ["red", "green", "blue"]
        .iter()
        .fold(text, |text, name| text.replace(&format!("float {name}"), &format!("uchar {name}")));
    let sh0 = read_model(Scene::new().write("a.ply", bytes)).expect("read").gaussians.sh0[0];
    for (found, expected) in sh0.iter().zip([1.0, 0.0, 0.2]) {
        assert!((0.5 + 0.282_094_8 * f64::from(*found) - expected).abs() < 1e-6, "{sh0:?}");
    }
    // Without rotations, the rows are points.
    let points: Vec<(&str, f64)> = [("x", 0.0), ("y", 0.0), ("z", 0.0)].into_iter().chain(colours).collect();
    let refused = refusal(read_model(Scene::new().write("a.ply", ply(&points, &[0.0]))));
    assert!(refused.contains("coloured points"), "{refused}");
}

#[test]
fn a_label_of_minus_one_is_none() {
    let scene = Scene::new();
    let columns = with(&[("label", 0.0)]);
    let read = read_model(scene.write("a.ply", ply(&columns, &[-1.0, 5.0, 0.0, -1.0]))).expect("read");
    assert_eq!(read.gaussians.labels, Some(vec![0, 5, 0, 0]));
    assert!(read.notes.len() == 1 && read.notes[0].starts_with("2 labels are -1"), "{:?}", read.notes);
    for bad in [-2.0, 1.5] {
        let refused = refusal(read_model(scene.write("a.ply", ply(&columns, &[5.0, bad]))));
        assert!(refused.contains(&format!("vertex 1: label {bad} ")) && refused.contains("another name"), "{refused}");
    }
}

/// Comments are free text, any white space separates words, and a byte order mark is not a word.
#[test]
fn headers_of_other_programs_are_read() {
    let scene = Scene::new();
    let good = ply(&PLAIN_COLUMNS, &[0.0]);
    let expected = read_model(scene.write("a.ply", &good)).expect("read").gaussians;
    let bytes = |from: &str, to: &[u8]| {
        let at = good.find(from).expect("the text");
        [&good.as_bytes()[..at], to, &good.as_bytes()[at + from.len()..]].concat()
    };
    let cases: [(&str, Vec<u8>); 7] = [
        ("Latin-1", bytes("comment x", b"comment by J\xFCrgen")),
        ("GBK", bytes("comment x", b"comment \xD6\xD0\xCE\xC4")),
        ("zeros", bytes("comment x", b"obj_info \0\0")),
        ("a byte order mark", bytes("ply\n", b"\xEF\xBB\xBFply\n")),
        ("tabs", bytes("property float x", b"\tproperty\tfloat \t x ")),
        ("CR and LF", good.replace('\n', "\r\n").into_bytes()),
        ("an empty line", bytes("comment x\n", b"\n\n")),
    ];
    for (what, bytes) in cases {
        let read = read_model(scene.write("a.ply", bytes)).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!((read.gaussians, read.notes.len()), (expected.clone(), 0), "{what}");
    }
    let refused = refusal(read_model(scene.write("a.ply", good.replace('\n', "\r"))));
    assert!(refused.contains("CR alone"), "{refused}");
    let refused = refusal(read_model(scene.write("a.ply", bytes("float x", b"float \xFC"))));
    assert!(refused.contains("header: ") && refused.contains("not text"), "{refused}");
}

/// The first bytes identify a file whatever its name, and the message says what to do.
#[test]
fn a_file_that_is_no_model_is_named() {
    let scene = Scene::new();
    let cases: [(&[u8], &str, &str); 6] = [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "a Git LFS pointer", "git lfs pull"),
        (b"<!DOCTYPE html>\n<html>", "a web page", "download it again"),
        (b"PK\x03\x04\x14\0\0\0", "a zip archive", "unpack"),
        (b"\0\0\0\x20ftypisom\0\0\0\0", "a video (MP4)", "frames"),
        (b"\xFF\xD8\xFF\xE0\0\x10JFIF\0", "a JPEG", "another file"),
        (b"", "an empty file", "again"),
    ];
    for (bytes, what, cure) in cases {
        for extension in ["ply", "spz", "glb", "sog", "splat", "html", "usda", "usdz"] {
            // These contents match their extensions as far as the first bytes show.
            if matches!((what, extension), ("a zip archive", "sog" | "usdz") | ("a web page", "html")) {
                continue;
            }
            let refused = refusal(read_model(scene.write(&format!("a.{extension}"), bytes)));
            assert!(refused.contains(&format!("is {what}, not ")) && refused.contains(cure), "{extension}: {refused}");
        }
    }
    let model = read(&PLAIN_COLUMNS).gaussians;
    write_model(scene.at("a.spz"), &model).expect("written");
    fs::rename(scene.at("a.spz"), scene.at("b.glb")).expect("renamed");
    assert!(refusal(read_model(scene.at("b.glb"))).contains("packed by gzip"));
    write_model(scene.at("c.glb"), &model).expect("written");
    fs::rename(scene.at("c.glb"), scene.at("c.ply")).expect("renamed");
    assert!(refusal(read_model(scene.at("c.ply"))).contains("is a GLB, not a file of the format PLY; name it *.glb"));
}
