//! Checkpoint files: exact round trips, and damaged files refused.

use crate::scenes::fixtures::*;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::records::checkpoint::{Checkpoint, Plane, VERSION};
use labelgs::records::checkpoint_folder;
use serde_json::json;
use std::fs;

fn example() -> Checkpoint {
    let plane = |name: &str, words: u32, rows: u32| Plane {
        name: name.to_owned(),
        words,
        data: (0..rows * words).map(|i| i.wrapping_mul(0x9e37_79b9)).collect(),
    };
    let bits = Plane { name: "bits".to_owned(), words: 1, data: vec![f32::NAN.to_bits(), (-0.0_f32).to_bits()] };
    let planes = vec![plane("means", 4, 60), plane("none", 3, 0), bits];
    Checkpoint { meta: json!({ "step": 7, "seed": u64::MAX, "views": ["ä.png"] }), planes }
}

#[test]
fn a_checkpoint_comes_back_to_the_last_bit() {
    let scene = Scene::new();
    // A plane that is longer than any I/O buffer.
    let large = Plane { name: "large".to_owned(), words: 5, data: (0..500_000).collect() };
    let mut file = example();
    file.planes.push(large);
    let path = scene.at("new/a.ckpt");
    file.write(&path).expect("written");
    assert_eq!(Checkpoint::read(&path).expect("read"), file);
    file.meta = json!(null);
    file.write(&path).expect("written over");
    assert_eq!(Checkpoint::read(&path).expect("read"), file);
    file.planes[0].data.pop();
    assert_eq!(exit_status(&file.write(&path).expect_err("half a row")), 70);
}

/// The message of a refusal, which names the file and ends with status 3.
#[track_caller]
fn refused(scene: &Scene, bytes: &[u8]) -> String {
    let path = scene.write("damaged.ckpt", bytes);
    let error = Checkpoint::read(&path).expect_err("it is damaged");
    assert_eq!(exit_status(&error), 3, "{error}");
    let text = error.to_string();
    assert!(text.contains("damaged.ckpt"), "{text}");
    text
}

#[test]
fn a_damaged_checkpoint_is_refused_with_the_reason() {
    let scene = Scene::new();
    let path = scene.at("a.ckpt");
    example().write(&path).expect("written");
    let whole = fs::read(&path).expect("bytes");
    let cuts = (0..64).chain((64..whole.len()).step_by(7)).chain([whole.len() - 1]);
    for length in cuts {
        let text = refused(&scene, &whole[..length]);
        assert!(text.contains("cut short"), "{length} bytes: {text}");
    }
    assert!(refused(&scene, &[whole.as_slice(), b"x"].concat()).contains("grew"));
    for at in 0..whole.len() {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        let text = refused(&scene, &flipped);
        let reason = match at {
            0..8 => "not a labelgs checkpoint",
            8..12 => "version",
            16..24 => "were written",
            _ => "checksum",
        };
        assert!(text.contains(reason), "byte {at}: {text}");
    }
    let mut newer = whole.clone();
    newer[8..12].copy_from_slice(&(VERSION + 1).to_le_bytes());
    let text = refused(&scene, &newer);
    let named = [format!("version {}", VERSION + 1), format!("version {VERSION}"), env!("CARGO_PKG_VERSION").into()];
    assert!(named.iter().all(|part| text.contains(part)), "{text}");
    assert!(refused(&scene, b"ply\nformat binary_little_endian 1.0\n").contains("not a labelgs checkpoint"));
}

/// Invalid contents with a correct checksum cause no large allocation and no panic.
#[test]
fn invalid_values_with_a_correct_checksum_are_refused() {
    let scene = Scene::new();
    let file = |json: &str, rest: &[u8], json_bytes: u64| {
        let body = [&json_bytes.to_le_bytes()[..], json.as_bytes(), rest].concat();
        let mut bytes = b"labelgsC".to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(crc32fast::hash(&body).to_le_bytes());
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(body);
        bytes
    };
    let with = |rows: &str, words: &str| {
        format!(r#"{{"meta": 1, "planes": [{{"name": "p", "rows": {rows}, "words": {words}}}]}}"#)
    };
    let two = with("2", "1");
    Checkpoint::read(&scene.write("fine.ckpt", file(&two, &[0; 8], two.len() as u64))).expect("this one is fine");
    for (json, rest) in [
        (two.clone(), 4),
        (two.clone(), 12),
        (with("4611686018427387905", "4"), 8),
        (with("9000000000000000000", "1"), 8),
        (with("-1", "1"), 8),
        ("{}".to_owned(), 0),
        ("no JSON".to_owned(), 0),
    ] {
        refused(&scene, &file(&json, &vec![0; rest], json.len() as u64));
    }
    refused(&scene, &file(&two, &[0; 8], u64::MAX));
    refused(&scene, &file(&two, &[0; 8], 3));
}

#[test]
fn the_newest_is_the_one_with_the_largest_number() {
    let scene = Scene::new();
    let out = scene.path();
    assert_eq!(checkpoint_folder::list(out).expect("no folder"), []);
    let first = checkpoint_folder::next(out, 900).expect("a name");
    assert!(first.ends_with("checkpoints/1-step-900.ckpt"), "{}", first.display());
    for name in ["9-step-900.ckpt", "10-step-30.ckpt", ".labelgs-1-x.tmp", "10-step.ckpt", "notes.txt"] {
        scene.write(&format!("checkpoints/{name}"), b"");
    }
    let found = checkpoint_folder::list(out).expect("a list");
    assert_eq!(found.iter().map(|found| (found.number, found.step)).collect::<Vec<_>>(), [(10, 30), (9, 900)]);
    assert!(checkpoint_folder::next(out, 40).expect("a name").ends_with("11-step-40.ckpt"));
    checkpoint_folder::keep(out, &[found[0].path.clone()]).expect("kept");
    assert_eq!(checkpoint_folder::list(out).expect("a list"), [found[0].clone()]);
    assert!(scene.at("checkpoints/notes.txt").exists(), "files other than checkpoints stay");
}
