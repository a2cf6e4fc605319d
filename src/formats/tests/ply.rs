//! Gaussians and points as PLY: round trips, foreign layouts, hostile files.

use super::fixtures::*;
use labelgs_formats::{LabelType, WriteOptions, export_model, read_model, write_model};
use labelgs_scene::Gaussians;
use labelgs_scenes::points::read_points;
use std::fs;

/// All values differ, so a swapped column is found.
fn gaussians(count: usize, degree: u32, labelled: bool) -> Gaussians {
    let mut g = Gaussians { sh_degree: degree, ..Gaussians::default() };
    let rest = g.rest_per_gaussian();
    let mut next = 0.0f32;
    let mut value = || {
        next += 0.37;
        next
    };
    for _ in 0..count {
        g.means.push([value(), value(), value()]);
        g.quats.push([value(), value(), value(), value()]);
        g.scales.push([value() % 5.0, value() % 5.0, value() % 5.0]);
        g.opacities.push(-value());
        g.sh0.push([value(), value(), value()]);
        g.sh_rest.extend((0..rest).map(|_| [value(), value(), value()]));
    }
    g.labels = labelled.then(|| (0..count as u32).map(|index| index * 65_535 / count.max(1) as u32).collect());
    g
}

#[test]
fn a_written_ply_is_read_back() {
    let scene = Scene::new();
    for degree in 0..=3 {
        for labelled in [false, true] {
            for count in [0, 1, 13] {
                let written = gaussians(count, degree, labelled);
                assert_eq!(write_model(scene.at("a.ply"), &written).expect("written"), 0);
                let read = read_model(scene.at("a.ply")).expect("read");
                assert_eq!((read.gaussians, read.dropped, read.notes.len()), (written, 0, 0));
            }
        }
    }
}

#[test]
fn the_layout_is_the_standard_one() {
    let scene = Scene::new();
    let g = gaussians(1, 1, true);
    write_model(scene.at("a.ply"), &g).expect("written");
    let bytes = fs::read(scene.at("a.ply")).expect("bytes");
    let names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 f_rest_5 f_rest_6 \
                 f_rest_7 f_rest_8 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\n{properties}property float label\nend_header\n"
    );
    assert_eq!(str::from_utf8(&bytes[..header.len()]).expect("text"), header);
    let row: Vec<f32> =
        bytes[header.len()..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    // Channel-major: all of red, then green, then blue.
    let rest = &g.sh_rest;
    let expected =
        [rest[0][0], rest[1][0], rest[2][0], rest[0][1], rest[1][1], rest[2][1], rest[0][2], rest[1][2], rest[2][2]];
    assert_eq!((&row[3..6], &row[9..18], row.len()), (&[0.0; 3][..], &expected[..], 27));
}

/// Rows with `uint label` are otherwise identical to those with `float label`, and both read alike.
#[test]
fn labels_are_written_as_floats_integers_or_not_at_all() {
    let scene = Scene::new();
    let g = Gaussians { label_confidence: Some(vec![0.5, 0.75, 1.0]), ..gaussians(3, 1, true) };
    let written = |label_type| {
        export_model(scene.at("a.ply"), &g, None, WriteOptions { label_type, ..WriteOptions::default() })
            .expect("written");
        (fs::read(scene.at("a.ply")).expect("bytes"), read_model(scene.at("a.ply")).expect("read").gaussians)
    };
    let ((float, of_float), (uint, of_uint)) = (written(LabelType::Float), written(LabelType::Uint));
    assert_eq!((&of_float, &of_uint), (&g, &g));
    let rows = |bytes: &[u8]| bytes[bytes.len() - 3 * 28 * 4..].to_vec();
    for (row, (float, uint)) in rows(&float).chunks_exact(112).zip(rows(&uint).chunks_exact(112)).enumerate() {
        let [a, b] = [float, uint].map(|row| <[u8; 4]>::try_from(&row[108..]).expect("4 bytes"));
        assert_eq!((&float[..108], f32::from_le_bytes(a)), (&uint[..108], u32::from_le_bytes(b) as f32), "row {row}");
    }
    let (bytes, without) = written(LabelType::None);
    assert!(!String::from_utf8_lossy(&bytes).contains("label"));
    assert_eq!(without, Gaussians { labels: None, label_confidence: None, ..g.clone() });
    // The first integer that a float rounds is refused before the old file is touched.
    let mut large = g;
    large.labels = Some(vec![1, 1 << 24, (1 << 24) + 1]);
    let error = write_model(scene.at("a.ply"), &large).expect_err("too large").to_string();
    assert!(error.contains("16777217") && error.contains("uint"), "{error}");
    assert_eq!(fs::read(scene.at("a.ply")).expect("bytes"), bytes);
}

/// The `state` of SuperSplat: bit 0 selected, bit 1 locked, bit 2 deleted.
#[test]
fn the_selection_of_an_editor_becomes_labels() {
    let scene = Scene::new();
    let text = String::from_utf8(foreign("ascii", "\n")).expect("text").replace("ushort label", "uchar state");
    for (state, label) in [(0, Some(0)), (1, Some(1)), (2, Some(0)), (3, Some(1)), (4, None), (5, None)] {
        let read = read_model(scene.write("a.ply", text.replace("65535", &state.to_string()))).expect("read");
        let labels: Vec<u32> = label.into_iter().collect();
        assert_eq!((read.gaussians.labels, read.dropped), (Some(labels), u64::from(label.is_none())), "state {state}");
        assert!(read.notes.iter().any(|note| note.contains("`state`")), "{:?}", read.notes);
    }
    // A label column takes precedence.
    let both = text.replace("char opacity", "uchar label").replace("int8 tail", "char opacity").replace(" -5 ", " 7 ");
    assert_eq!(read_model(scene.write("a.ply", both)).expect("read").gaussians.labels, Some(vec![7]));
}

/// Positions stay 32-bit floats; the origin is in a comment and beside the file.
#[test]
fn a_far_origin_is_in_a_comment_and_beside_the_file() {
    let scene = Scene::new();
    let origin = glam::DVec3::new(448_256.0, 5_411_840.0, 0.1);
    let g = Gaussians { origin, ..gaussians(3, 0, true) };
    write_model(scene.at("a.ply"), &g).expect("written");
    let bytes = fs::read(scene.at("a.ply")).expect("bytes");
    let header = String::from_utf8_lossy(&bytes[..300]).into_owned();
    assert!(header.contains("\ncomment labelgs world_origin 448256.0 5411840.0 0.1\n"), "{header}");
    assert!(header.contains("property float x\n"), "{header}");
    assert_eq!(read_model(scene.at("a.ply")).expect("read").gaussians, g);
    // Without the comment, as after another program, the file beside the model is used, unless it belongs to another
    // model.
    let text = "comment labelgs world_origin 448256.0 5411840.0 0.1\n";
    let at = bytes.windows(text.len()).position(|part| part == text.as_bytes()).expect("the comment");
    scene.write("a.ply", [&bytes[..at], &bytes[at + text.len()..]].concat());
    assert_eq!(read_model(scene.at("a.ply")).expect("read").gaussians, g);
    let beside = fs::read_to_string(scene.at("a.ply.origin.json")).expect("a file");
    scene.write("a.ply.origin.json", beside.replace("\"gaussians\": 3", "\"gaussians\": 4"));
    let read = read_model(scene.at("a.ply")).expect("read");
    assert_eq!((read.gaussians.origin, read.notes.len()), (glam::DVec3::ZERO, 1));
    for (from, to) in [("448256.0", "1e300"), ("world_origin", "origin"), ("version\": 1", "version\": 2")] {
        scene.write("a.ply.origin.json", beside.replace(from, to));
        assert!(refusal(read_model(scene.at("a.ply"))).contains("a.ply.origin.json: "));
    }
    let broken = String::from_utf8_lossy(&bytes).replace(" 0.1\n", " one\n");
    assert!(refusal(read_model(scene.write("b.ply", broken))).contains("three numbers"));
    // Writing a model near the origin removes the file beside it.
    write_model(scene.at("a.ply"), &gaussians(3, 0, true)).expect("written");
    assert!(!scene.path().join("a.ply.origin.json").exists());
}

/// A PLY of one Gaussian with another order and other types of columns, and with unknown columns.
fn foreign(format: &str, line_end: &str) -> Vec<u8> {
    let columns: [(&str, &str, f64); 19] = [
        ("double", "rot_3", 0.4),
        ("float", "rot_2", 0.3),
        ("float", "rot_1", 0.2),
        ("float32", "rot_0", 0.1),
        ("int", "x", -7.0),
        ("short", "y", 300.0),
        ("double", "z", 2.5),
        ("uchar", "extra_flag", 9.0),
        ("float", "scale_2", -3.0),
        ("float", "scale_0", -1.0),
        ("float", "scale_1", -2.0),
        ("char", "opacity", -5.0),
        ("float", "f_dc_2", 0.75),
        ("float", "f_dc_0", 0.25),
        ("float", "f_dc_1", 0.5),
        ("ushort", "label", 65_535.0),
        ("uint", "id", 4e9),
        ("float64", "confidence", 0.9),
        ("int8", "tail", -1.0),
    ];
    let mut text = format!("ply{line_end}format {format} 1.0{line_end}comment hello there{line_end}");
    text += &format!("element camera 2{line_end}property float focal{line_end}element vertex 1{line_end}");
    columns.iter().for_each(|(kind, name, _)| text += &format!("property {kind} {name}{line_end}"));
    text += &format!("end_header{line_end}");
    let mut bytes = text.into_bytes();
    if format == "ascii" {
        let row: Vec<String> = columns.iter().map(|column| column.2.to_string()).collect();
        bytes.extend(format!("1.5{line_end}2.5{line_end}{}{line_end}", row.join(" ")).bytes());
        return bytes;
    }
    let mut push = |little: Vec<u8>| {
        let ordered: Vec<u8> = if format.contains("big") { little.into_iter().rev().collect() } else { little };
        bytes.extend(ordered);
    };
    (0..2).for_each(|_| push(1.5f32.to_le_bytes().to_vec()));
    for (kind, _, value) in columns {
        push(match kind {
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" => (value as u8).to_le_bytes().to_vec(),
            "short" => (value as i16).to_le_bytes().to_vec(),
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" => (value as i32).to_le_bytes().to_vec(),
            "uint" => (value as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        });
    }
    bytes
}

#[test]
fn columns_are_found_by_name_in_any_type_and_byte_order() {
    let scene = Scene::new();
    for (format, line_end) in [
        ("ascii", "\n"),
        ("ascii", "\r\n"),
        ("binary_little_endian", "\n"),
        ("binary_big_endian", "\n"),
        ("binary_little_endian", "\r\n"),
    ] {
        let read = read_model(scene.write("a.ply", foreign(format, line_end))).expect("read");
        let expected = Gaussians {
            means: vec![[-7.0, 300.0, 2.5]],
            quats: vec![[0.1, 0.2, 0.3, 0.4]],
            scales: vec![[-1.0, -2.0, -3.0]],
            opacities: vec![-5.0],
            sh0: vec![[0.25, 0.5, 0.75]],
            labels: Some(vec![65_535]),
            ..Gaussians::default()
        };
        assert_eq!(read.gaussians, expected, "{format}");
    }
}

#[test]
fn unusable_rows_are_dropped_and_counted() {
    let scene = Scene::new();
    for degree in 0..=3 {
        let clean = gaussians(6, degree, true);
        let mut poisoned = clean.clone();
        poisoned.means[1][2] = f32::NAN;
        poisoned.quats[3] = [0.0; 4];
        poisoned.scales[4][1] = 90.0;
        // The writer drops rows that are not finite, the reader the other invalid rows.
        assert_eq!(write_model(scene.at("a.ply"), &poisoned).expect("written"), 1);
        let read = read_model(scene.at("a.ply")).expect("read");
        assert_eq!(read.gaussians, clean.filtered(|row| ![1, 3, 4].contains(&row)));
        assert_eq!(read.dropped, 2);
        assert!(
            read.notes[0].contains("2 of 5") && read.notes[0].contains("1 with a zero rotation"),
            "{:?}",
            read.notes
        );
    }
    let text = String::from_utf8(foreign("ascii", "\n")).expect("text");
    for bad in ["NaN", "inf", "-inf", "1e300"] {
        let read = read_model(scene.write("b.ply", text.replace(" 2.5 ", &format!(" {bad} ")))).expect("read");
        assert_eq!((read.gaussians.len(), read.dropped), (0, 1));
    }
    let tiny = text.replace("0.4 0.3 0.2 0.1", "0 0 1e-30 1e-30");
    let quat = read_model(scene.write("c.ply", tiny)).expect("read").gaussians.quats[0];
    assert!((quat[0] - 0.5f32.sqrt()).abs() < 1e-6 && quat[0] == quat[1]);
}

#[test]
fn labels_of_any_type_are_whole_numbers_below_two_to_the_31() {
    let scene = Scene::new();
    let text = String::from_utf8(foreign("ascii", "\n")).expect("text");
    for kind in ["uchar", "int", "uint", "float", "double"] {
        let typed = text.replace("property ushort label", &format!("property {kind} label"));
        let read = read_model(scene.write("a.ply", typed.replace("65535", "7"))).expect("read");
        assert_eq!(read.gaussians.labels, Some(vec![7]));
    }
    let typed = text.replace("property ushort label", "property double label");
    let read = read_model(scene.write("a.ply", typed.replace("65535", "2147483647"))).expect("read");
    assert_eq!(read.gaussians.labels, Some(vec![2_147_483_647]));
    for bad in ["2147483648", "-2", "1.5", "nan", "1e99"] {
        let error = refusal(read_model(scene.write("a.ply", typed.replace("65535", bad))));
        assert!(error.contains("vertex 0") && error.contains("2147483647"), "{error}");
    }
}

#[test]
fn hostile_headers_are_refused_quickly() {
    let scene = Scene::new();
    let good = String::from_utf8(foreign("ascii", "\n")).expect("text");
    let refuse = |text: String| refusal(read_model(scene.write("a.ply", text)));
    for count in ["-1", "18446744073709551616", "x"] {
        refuse(good.replace("vertex 1\n", &format!("vertex {count}\n")));
    }
    for count in [u64::MAX, u64::from(u32::MAX), 2] {
        assert!(refuse(good.replace("vertex 1\n", &format!("vertex {count}\n"))).contains("cut short"));
        let mut binary = foreign("binary_little_endian", "\n");
        let at = binary.windows(9).position(|w| w == b"vertex 1\n").expect("the element");
        binary.splice(at..at + 9, format!("vertex {count}\n").into_bytes());
        assert!(refusal(read_model(scene.write("b.ply", &binary))).contains(&count.to_string()));
    }
    refuse(good.replace("camera 2\n", "camera 18446744073709551615\n"));
    assert!(refuse(format!("ply\ncomment {}\n", "x".repeat(1 << 20))).contains("65536"));
    assert!(refuse(good.replace("property float scale_1\n", "")).contains("scale_1"));
    assert!(refuse(good.replace("scale_1", "scale_0")).contains("twice"));
    assert!(refuse(good.replace("uchar extra_flag", "list uchar int extra_flag")).contains("list"));
    assert!(refuse(good.replace("extra_flag", "f_rest_0")).contains("f_rest_"));
    assert!(refuse(good.replace("float scale_1", "quad scale_1")).contains("header"));
    assert!(refuse(good.replace("element vertex", "element points")).contains("vertex"));
    assert!(refuse(good.replace("extra_flag", "packed_position")).contains("compressed PLY"));
    assert!(refuse(good.replace(" 300 ", " three ")).contains("three"));
    assert!(refuse(good.replace(" 300 ", " ")).contains("values"));
    assert!(refuse("solid stl".into()).contains("ply"));
    assert!(refuse(String::new()).contains("ply"));
    assert!(refuse("ply\nend_header\n".into()).contains("header"));
    refusal(read_model(scene.path().join("absent.ply")));
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let scene = Scene::new();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let whole = foreign(format, "\n");
        // An ASCII file may lose its last line end. Losing another digit still gives a valid number.
        let last = if format == "ascii" { whole.len() - 3 } else { whole.len() };
        (0..last).for_each(|length| {
            refusal(read_model(scene.write("a.ply", &whole[..length])));
        });
    }
    let mut longer = foreign("binary_little_endian", "\n");
    longer.extend([0; 5]);
    assert!(read_model(scene.write("a.ply", longer)).expect("read").notes.iter().any(|note| note.contains("5 bytes")));
}

#[test]
fn points_have_colours_of_either_kind_or_none() {
    let scene = Scene::new();
    let read = |colour: &str, rows: &str| {
        let colours: String = ["red", "green", "blue"]
            .iter()
            .filter(|_| !colour.is_empty())
            .map(|c| format!("property {colour} {c}\n"))
            .collect();
        let count = rows.lines().count();
        let head = format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
        );
        read_points(scene.write("p.ply", format!("{head}{colours}end_header\n{rows}")))
    };
    let points = read("uchar", "1 2 3 4 5 6\nnan 0 0 1 1 1\n-1 0.5 0 255 0 1\n").expect("points");
    assert_eq!((points.len(), points[0].colour, points[1].colour), (2, [4, 5, 6], [255, 0, 1]));
    assert_eq!(points[1].position.to_array(), [-1.0, 0.5, 0.0]);
    assert_eq!(read("float", "0 0 0 0.5 0 1\n").expect("points")[0].colour, [128, 0, 255]);
    assert_eq!(read("float", "0 0 0 0.5 0 200\n").expect("points")[0].colour, [1, 0, 200]);
    assert_eq!(read("", "0 0 0\n").expect("points")[0].colour, [128; 3]);
    refusal(read("float", "0 0 0 nan 0 200\n"));
    let points_as_gaussians = refusal(read_model(scene.path().join("p.ply")));
    assert!(points_as_gaussians.contains("points"), "{points_as_gaussians}");
}
