//! Model formats besides PLY: what a round trip may change, what it preserves, and how bad files are refused.

use super::fixtures::*;
use super::models::*;
use glam::DVec3;
use labelgs_files::{LabelEntry, LabelTable};
use labelgs_formats::{FirstView, LabelType, LazyModel, WriteOptions, export_model, read_model, write_model};
use labelgs_scene::Gaussians;
use std::fs;

fn names() -> LabelTable {
    let named = |id, name: &str| LabelEntry { name: Some(name.into()), ..LabelEntry::new(id) };
    LabelTable::new(vec![named(3, "cup"), named(700, "größter Krug")])
}

fn unit(quat: [f32; 4]) -> [f32; 4] {
    let length = quat.iter().map(|v| v * v).sum::<f32>().sqrt();
    quat.map(|v| v / length)
}

/// Largest difference between two rotations of a Gaussian. Both signs are the same rotation, and half turns about the
/// Gaussian's own axes leave it unchanged; some writers apply them.
fn apart(a: [f32; 4], [w, x, y, z]: [f32; 4]) -> f32 {
    let same = [[w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]];
    let of = |b: [f32; 4], sign: f32| a.iter().zip(b).map(|(a, b)| (a - sign * b).abs()).fold(0.0_f32, f32::max);
    same.into_iter().flat_map(|b| [of(b, 1.0), of(b, -1.0)]).fold(f32::MAX, f32::min)
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}

/// Fails if a value of `after` differs from `before` by more than its bound.
#[track_caller]
fn within(before: &Gaussians, after: &Gaussians, bounds: Bounds) {
    assert_eq!((before.len(), before.sh_degree, &before.labels), (after.len(), after.sh_degree, &after.labels));
    let most = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0_f32, f32::max);
    let check = |what: &str, off: f32, bound: f32| {
        assert!(off <= bound, "{what} are off by {off}, at most {bound} are allowed")
    };
    check("positions", most(before.means.as_flattened(), after.means.as_flattened()), bounds.position);
    check("scales", most(before.scales.as_flattened(), after.scales.as_flattened()), bounds.scale);
    check("colours", most(before.sh0.as_flattened(), after.sh0.as_flattened()), bounds.colour);
    for (&a, &b) in before.opacities.iter().zip(&after.opacities) {
        check("opacities", (sigmoid(a) - sigmoid(b)).abs(), bounds.opacity);
    }
    for (&a, &b) in before.quats.iter().zip(&after.quats) {
        check("rotations", apart(unit(a), unit(b)), bounds.rotation);
    }
    let rest = before.rest_per_gaussian().max(1);
    for (at, (a, b)) in before.sh_rest.iter().zip(&after.sh_rest).enumerate() {
        check("harmonics", most(a, b), bounds.harmonics[usize::from(at % rest >= 3)]);
    }
    if let (Some(before), Some(after)) = (&before.label_confidence, &after.label_confidence) {
        check("confidences", most(before, after), bounds.confidence);
    }
    assert_eq!(before.label_confidence.is_some(), after.label_confidence.is_some());
}

#[test]
fn round_trips_stay_within_the_steps_and_keep_labels_and_names() {
    let scene = Scene::new();
    for (file, options, bounds) in written() {
        for degree in 0..=3 {
            for (count, labelled) in [(1, true), (300, true), (300, false)] {
                let before = model(count, degree, labelled);
                let names = labelled.then(names);
                assert_eq!(export_model(scene.at(file), &before, names.as_ref(), options).expect("written"), 0);
                let read = read_model(scene.at(file)).expect("read");
                within(&before, &in_order_of(&read.gaussians, &before), bounds);
                assert_eq!((read.dropped, &read.notes), (0, &Vec::new()), "{file}");
                let name = |table: Option<&LabelTable>| table.and_then(|table| table.entry(3)?.name.clone());
                assert!(count == 1 || name(read.names.as_ref()) == name(names.as_ref()), "{file}: {:?}", read.names);
            }
        }
        // No trace of the labels remains if none are wanted.
        let none = WriteOptions { label_type: LabelType::None, ..options };
        export_model(scene.at(file), &model(9, 0, true), Some(&names()), none).expect("written");
        let read = read_model(scene.at(file)).expect("read");
        assert_eq!((read.gaussians.labels, read.names), (None, None), "{file}");
        assert!(!LabelTable::path_beside(&scene.at(file)).exists());
        // A second write has the same bytes.
        let write = || {
            export_model(scene.at(file), &model(300, 2, true), Some(&names()), options).expect("written");
            fs::read(scene.at(file)).expect("bytes")
        };
        assert!(write() == write(), "{file}");
    }
}

/// Each format records whether its model is antialiased.
#[test]
fn an_antialiased_model_stays_one() {
    let scene = Scene::new();
    for antialiased in [true, false] {
        let before = Gaussians { antialiased, ..model(50, 1, true) };
        for (file, options, _) in written() {
            export_model(scene.at(file), &before, None, options).expect("written");
            assert_eq!(read_model(scene.at(file)).expect("read").gaussians.antialiased, antialiased, "{file}");
        }
    }
}

/// Positions of a faraway scene are relative to an origin beside the file.
#[test]
fn far_scenes_keep_their_place() {
    let scene = Scene::new();
    let origin = glam::DVec3::new(448_256.0, 5_411_840.0, 128.0);
    let before = Gaussians { origin, ..model(50, 0, true) };
    for (file, options, bounds) in written() {
        export_model(scene.at(file), &before, None, options).expect("written");
        let after = read_model(scene.at(file)).expect("read").gaussians;
        assert_eq!(after.origin, origin, "{file}");
        within(&before, &in_order_of(&after, &before), bounds);
    }
}

/// 24 bits hold any scene: a large one has fewer fractional bits, a small one more, and no value wraps around.
#[test]
fn positions_of_an_spz_never_wrap() {
    let scene = Scene::new();
    for size in [1e-6, 1e-3, 0.5, 1.0, 2047.0, 2049.0, 3e5, 8e6] {
        let mut before = model(100, 0, false);
        before.means.iter_mut().for_each(|mean| *mean = mean.map(|value| value / 8.0 * size));
        before.means.push([size, -size, size]);
        before = Gaussians { means: before.means, ..model(101, 0, false) };
        write_model(scene.at("a.spz"), &before).expect("written");
        let after = read_model(scene.at("a.spz")).expect("read").gaussians;
        // Half of 2^-23 of the size, or of the usual steps; there are no more bits below 2^-23.
        let step = (size / 4.19e6).max(1.0 / 4096.0_f32.max(16_384.0 / size).min(8_388_608.0));
        let off = before.means.as_flattened().iter().zip(after.means.as_flattened()).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0_f32, f32::max);
        assert!(off <= 0.51 * step, "a scene of {size}: off by {off}, steps of {step}");
    }
    let mut far = model(1, 0, false);
    far.means[0][1] = 9e6;
    let error = write_model(scene.at("b.spz"), &far).expect_err("too far").to_string();
    assert!(error.contains("9000000 from the origin") && !scene.path().join("b.spz").exists(), "{error}");
}

/// An opacity of 0 or 1 has no finite logit and is moved by a step.
#[test]
fn opacities_stay_finite() {
    let scene = Scene::new();
    let mut before = model(4, 0, false);
    before.opacities = vec![-200.0, 200.0, -17.0, 17.0];
    for (file, options, bounds) in written() {
        export_model(scene.at(file), &before, None, options).expect("written");
        let after = in_order_of(&read_model(scene.at(file)).expect("read").gaussians, &before);
        for (&a, &b) in before.opacities.iter().zip(&after.opacities) {
            let off = (sigmoid(a) - sigmoid(b)).abs();
            assert!(b.is_finite() && off <= 2.01 * bounds.opacity, "{file}: {a} and {b}");
        }
    }
}

/// The labels beside an SPZ are used if another program dropped the record, and only for the same Gaussians.
#[test]
fn labels_beside_a_file_hold_for_the_same_gaussians_only() {
    let scene = Scene::new();
    let (whole, part) = (model(60, 1, true), model(60, 1, true).filtered(|row| row != 7));
    let bare = WriteOptions { label_type: LabelType::None, ..WriteOptions::default() };
    let drop_record = |of: &Gaussians| {
        export_model(scene.at("bare/a.spz"), of, None, bare).expect("written");
        fs::copy(scene.at("bare/a.spz"), scene.at("a.spz")).expect("copied");
    };
    export_model(scene.at("a.spz"), &whole, Some(&names()), WriteOptions::default()).expect("written");
    drop_record(&whole);
    let read = read_model(scene.at("a.spz")).expect("read");
    assert_eq!((&read.gaussians.labels, read.notes.len()), (&whole.labels, 0));
    // The names file beside it is the usual one.
    assert_eq!(LabelTable::read(&scene.at("a.labels.json")).expect("a table"), names());
    let text = fs::read_to_string(scene.at("a.labels.json")).expect("text");
    for (from, to) in [("\"ids\"", "\"id\""), ("700", "2147483700"), ("\"count\": 60", "\"count\": \"many\"")] {
        scene.write("a.labels.json", text.replace(from, to));
        let error = refusal(read_model(scene.at("a.spz")));
        assert!(error.contains("a.labels.json: "), "{error}");
    }
    scene.write("a.labels.json", &text);
    for other in [part, whole.filtered(|row| row < 30), {
        let mut moved = whole.clone();
        moved.means.swap(3, 4);
        moved
    }] {
        drop_record(&other);
        let read = read_model(scene.at("a.spz")).expect("read");
        assert!(read.gaussians.labels.is_none() && read.notes[0].contains("a.labels.json"), "{:?}", read.notes);
    }
}

fn golden(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// Reorders a model like another one, by nearest position: some writers sort.
fn in_order_of(model: &Gaussians, other: &Gaussians) -> Gaussians {
    let distance = |a: [f32; 3], b: [f32; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f32>();
    let nearest = |place: &[f32; 3]| {
        let rows = 0..model.len();
        rows.min_by(|&a, &b| distance(model.means[a], *place).total_cmp(&distance(model.means[b], *place)))
            .expect("a row")
    };
    let rows: Vec<usize> = other.means.iter().map(nearest).collect();
    let parts: Vec<Gaussians> = rows.iter().map(|&row| model.filtered(|own| own == row)).collect();
    Gaussians {
        antialiased: false,
        origin: model.origin,
        means: parts.iter().flat_map(|part| part.means.clone()).collect(),
        quats: parts.iter().flat_map(|part| part.quats.clone()).collect(),
        scales: parts.iter().flat_map(|part| part.scales.clone()).collect(),
        opacities: parts.iter().flat_map(|part| part.opacities.clone()).collect(),
        sh0: parts.iter().flat_map(|part| part.sh0.clone()).collect(),
        sh_rest: parts.iter().flat_map(|part| part.sh_rest.clone()).collect(),
        sh_degree: model.sh_degree,
        labels: model.labels.as_ref().map(|labels| rows.iter().map(|&row| labels[row]).collect()),
        label_confidence: model.label_confidence.as_ref().map(|shares| rows.iter().map(|&row| shares[row]).collect()),
    }
}

/// Files that other programs wrote from `source.ply`: splat-transform 2.7.1, and for `.splat` the rules of the
/// converter that defined it. Their axes and quantisation are read as intended.
#[test]
fn files_of_other_writers_are_read() {
    let source = read_model(golden("source.ply")).expect("read").gaussians;
    assert_eq!((source.len(), source.sh_degree), (24, 3));
    for name in ["splat-transform-v3.spz", "splat-transform-v4.spz"] {
        let read = read_model(golden(name)).expect("read");
        within(&source, &read.gaussians, SPZ);
        assert_eq!(read.notes, Vec::<String>::new(), "{name}");
    }
    within(&source, &read_model(golden("splat-transform.glb")).expect("read").gaussians, GLB);
    // Codebooks have a number for each value of so few Gaussians; 16 entries suffice for 24 harmonics.
    let sog = read_model(golden("splat-transform.sog")).expect("read").gaussians;
    within(&source, &in_order_of(&sog, &source), Bounds { opacity: 1.01 / 255.0, ..SOG });
    // One chunk: half of a step of 10 bits over its bounds; rotations 10 bits over sqrt 2, and three times that for the
    // largest component; harmonics 1/32.
    let span = |values: &[[f32; 3]]| {
        let all = values.as_flattened();
        all.iter().fold(f32::MIN, |a, &b| a.max(b)) - all.iter().fold(f32::MAX, |a, &b| a.min(b))
    };
    let packed = read_model(golden("splat-transform.compressed.ply")).expect("read").gaussians;
    within(
        &source,
        &in_order_of(&packed, &source),
        Bounds {
            position: 1.01 * span(&source.means) / 2046.0,
            rotation: 3.05 * std::f32::consts::SQRT_2 / 2046.0,
            scale: 1.01 * span(&source.scales) / 2046.0,
            opacity: 1.01 / 510.0,
            colour: 1.01 * span(&source.sh0) / 510.0,
            harmonics: [1.01 / 64.0; 2],
            confidence: 0.0,
        },
    );
    // Bytes are truncated, not rounded: a full step of 1/128 for rotations, which then no longer have unit length, and
    // of 1/255 for colours.
    let flat = Gaussians { sh_degree: 0, sh_rest: Vec::new(), ..source };
    within(
        &flat,
        &read_model(golden("source.splat")).expect("read").gaussians,
        Bounds {
            position: 0.0,
            rotation: 2.01 / 128.0,
            scale: 1e-5,
            opacity: 1.01 / 255.0,
            colour: 1.01 / 255.0 / 0.282_094_8,
            harmonics: [0.0; 2],
            confidence: 0.0,
        },
    );
}

#[test]
fn formats_that_are_only_read_say_so() {
    let scene = Scene::new();
    let error = write_model(scene.at("a.splat"), &model(1, 0, false)).expect_err("read only").to_string();
    assert!(
        error.contains(".splat files can only be read; models are written as")
            && error.contains(".ply, .spz, .glb, .sog, .html, .usda, .usd, .usdz"),
        "{error}"
    );
}

/// A message about a bad file names the file, the location, and what was expected.
#[test]
fn bad_files_are_refused_by_file_place_and_cure() {
    let scene = Scene::new();
    let [v3, v4, glb] = ["splat-transform-v3.spz", "splat-transform-v4.spz", "splat-transform.glb"]
        .map(|name| fs::read(golden(name)).expect("bytes"));
    let packed = fs::read(golden("splat-transform.compressed.ply")).expect("bytes");
    let splat = fs::read(golden("source.splat")).expect("bytes");
    let with = |bytes: &[u8], at: usize, value: u8| {
        let mut bytes = bytes.to_vec();
        bytes[at] = value;
        bytes
    };
    let text = |bytes: &[u8], from: &str, to: &str| {
        let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).expect("the text");
        [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
    };
    let sog = fs::read(golden("splat-transform.sog")).expect("bytes");
    export_model(scene.at("whole.html"), &model(9, 0, true), None, WriteOptions::default()).expect("written");
    let page = fs::read(scene.at("whole.html")).expect("bytes");
    let cases: [(&str, Vec<u8>, &[&str]); 20] = [
        ("a.spz", b"PK".to_vec(), &["a.spz: byte 0: ", "not an SPZ file"]),
        ("a.spz", v3[..v3.len() / 2].to_vec(), &["a.spz: planes: ", "cut short"]),
        ("a.spz", with(&v4, 4, 9), &["a.spz: byte 4: ", "1 to 4 are read"]),
        ("a.spz", with(&v4, 11, 0x10), &["a.spz: byte 8: ", "promises 268435480 Gaussians"]),
        ("a.spz", with(&v4, 12, 7), &["a.spz: byte 12: ", "0 to 4"]),
        ("a.spz", with(&v4, 15, 2), &["a.spz: byte 15: ", "expected 6"]),
        ("a.spz", v4[..v4.len() - 9].to_vec(), &["a.spz: stream 5: ", "are left"]),
        ("a.glb", b"glTX".to_vec(), &["a.glb: byte 0: ", "not a GLB file"]),
        ("a.glb", glb[..glb.len() - 4].to_vec(), &["a.glb: byte ", "`BIN`", "cut short"]),
        ("a.glb", text(&glb, "\"count\":24", "\"count\":99"), &["a.glb: accessor 0 of POSITION: ", "99 elements"]),
        (
            "a.glb",
            text(&glb, "splatting:SCALE", "splatting:SKALE"),
            &["a.glb: attributes: lacks KHR_gaussian_splatting:SCALE"],
        ),
        ("a.ply", packed[..packed.len() - 1].to_vec(), &["a.ply: header: ", "`sh`", "cut short"]),
        (
            "a.ply",
            text(&packed, "element chunk 1", "element chunk 0"),
            &["a.ply: header: ", "0 chunks for 24 Gaussians"],
        ),
        ("a.sog", sog[..sog.len() - 30].to_vec(), &["a.sog: end of the archive: ", "cut short"]),
        ("a.sog", text(&sog, "\"version\":2", "\"version\":1"), &["a.sog: meta.json: cannot be unpacked: "]),
        ("a.sog", text(&sog, "RIFF", "RAFF"), &["a.sog: means_l.webp: "]),
        ("a.html", b"<p>A page.</p>".to_vec(), &["a.html: contains no model", "written by labelgs"]),
        ("a.html", text(&page, "H4sI", "H4*I"), &["a.html: embedded model: ", "not base64"]),
        ("a.html", text(&page, "H4sI", "AAAA"), &["a.html: byte 0: ", "not an SPZ file"]),
        ("a.splat", splat[..splat.len() - 1].to_vec(), &["a.splat: byte 736: ", "multiple of 32"]),
    ];
    for (name, bytes, expected) in cases {
        let error = refusal(read_model(scene.write(name, bytes)));
        println!("{}", error.replace(&format!("{}/", scene.path().display()), ""));
        assert!(expected.iter().all(|part| error.contains(part)), "{error}");
    }
}

/// Each format stores the initial view; without one, a file has the same bytes as before.
#[test]
fn a_first_view_comes_back() {
    let scene = Scene::new();
    let view = FirstView { up: DVec3::new(0.0, -0.6, 0.8), eye: DVec3::new(448_256.25, -3.5, 1.0 / 3.0) };
    for (file, options, _) in written() {
        for labelled in [true, false] {
            let before = model(50, 1, labelled);
            let export = |first_view: Option<FirstView>| {
                let options = WriteOptions { first_view, ..options };
                export_model(scene.at(file), &before, None, options).expect("written");
                read_model(scene.at(file)).expect("read")
            };
            assert_eq!(export(None).first_view, None, "{file}");
            let read = export(Some(view));
            assert_eq!((read.first_view, &read.notes), (Some(view), &Vec::new()), "{file}");
            assert_eq!(read.gaussians, export(None).gaussians, "{file}");
        }
    }
    // An SPZ without labels has no records at all, because some readers warn about them.
    let options = WriteOptions { label_type: LabelType::None, first_view: Some(view), ..WriteOptions::default() };
    export_model(scene.at("a.spz"), &model(50, 1, true), None, options).expect("written");
    assert_eq!(read_model(scene.at("a.spz")).expect("read").first_view, None);
}

/// PLY comments are free text, so damaged ones do not make a file invalid.
#[test]
fn a_damaged_first_view_of_a_ply_does_not_matter() {
    let scene = Scene::new();
    let view = FirstView { up: DVec3::NEG_Y, eye: DVec3::new(1.0, 2.0, 3.0) };
    let options = WriteOptions { first_view: Some(view), ..WriteOptions::default() };
    export_model(scene.at("a.ply"), &model(3, 0, false), None, options).expect("written");
    let bytes = fs::read(scene.at("a.ply")).expect("bytes");
    let at = |part: &[u8]| bytes.windows(part.len()).position(|window| window == part).expect("a comment");
    let (up, eye) = (at(b"comment labelgs up 0.0 -1.0 0.0"), at(b"comment labelgs eye 1.0 2.0 3.0"));
    assert_eq!(LazyModel::open(&scene.at("a.ply")).expect("opened").first_view(), Some(view));
    // Not a number, no direction, not a number, only two numbers.
    for (place, letter) in [(up + 19, b'x'), (up + 24, b'0'), (eye + 20, b'e'), (eye + 23, b'1')] {
        let mut bytes = bytes.clone();
        bytes[place] = letter;
        let read = read_model(scene.write("b.ply", bytes)).expect("read");
        assert_eq!((read.first_view, read.gaussians.len()), (None, 3), "{place}");
    }
}
