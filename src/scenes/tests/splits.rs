//! Splits that come with a data set.

use super::fixtures::*;
use super::{names, noted};
use labelgs_scene::Dataset;
use labelgs_scenes::{self as scenes, LoadOptions};
use std::fs;

fn open(scene: &Scene) -> Dataset {
    scenes::open(scene.path(), &LoadOptions::default()).expect("a scene")
}

fn frames(range: std::ops::Range<usize>) -> String {
    let frame = |index| {
        format!(
            r#"{{"file_path": "images/{index:02}.png", "transform_matrix": [[1,0,0,{index}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}"#
        )
    };
    range.map(frame).collect::<Vec<_>>().join(",")
}

/// Photos `00.png` and following, posed by transforms with `more` keys.
fn transforms(count: usize, more: &str) -> Scene {
    let scene = Scene::new();
    (0..count).for_each(|index| scene.photo(&format!("images/{index:02}.png"), 12, 8));
    scene.write("transforms.json", format!(r#"{{"fl_x": 10, {more} "frames": [{}]}}"#, frames(0..count)));
    scene
}

#[test]
fn lists_of_file_names_hold_out_and_leave_out() {
    let lists = r#""train_filenames": ["images/01.png", "./images/02.png"], "val_filenames": ["images/03.png"],
                   "test_filenames": ["images/03.png", "images/04.png", "images/99.png"],"#;
    let dataset = open(&transforms(6, lists));
    assert_eq!((names(&dataset.train), names(&dataset.test)), (vec!["01.png", "02.png"], vec!["03.png", "04.png"]));
    let note = dataset.notes.iter().find(|note| note.contains("held out")).expect("a note");
    assert!(
        note.contains("2 photos held out") && note.contains("2 photos in no list") && note.contains("00.png"),
        "{note}"
    );
    assert!(note.contains("1 more in the list") && note.contains("test_every"), "{note}");
    // Only held-out photos are listed: the others are for training.
    let dataset = open(&transforms(3, r#""test_filenames": ["images/02.png"],"#));
    assert_eq!((dataset.train.len(), names(&dataset.test)), (2, vec!["02.png"]));
    let dataset = super::open(&transforms(3, r#""test_filenames": ["images/02.png"],"#)).expect("a scene");
    assert_eq!((dataset.train.len(), dataset.test.len()), (3, 0));
    // Lists of another scene.
    let dataset = open(&transforms(9, r#""train_filenames": ["a.png"], "test_filenames": ["b.png"],"#));
    assert_eq!((dataset.train.len(), names(&dataset.test)), (7, vec!["00.png", "08.png"]));
    noted(&dataset.notes, &["names no photo"]);
}

#[test]
fn test_frames_are_held_out_and_bad_ones_left_out() {
    let scene = Scene::new();
    (0..5).for_each(|index| scene.photo(&format!("images/{index:02}.png"), 12, 8));
    let bad = frames(1..2).replace(r#""file_path""#, r#""is_bad": true, "file_path""#);
    let all = [frames(0..1), bad, frames(2..3)].join(",");
    scene.write("transforms.json", format!(r#"{{"fl_x": 10, "frames": [{all}], "test_frames": [{}]}}"#, frames(3..5)));
    let dataset = open(&scene);
    assert_eq!((names(&dataset.train), names(&dataset.test)), (vec!["00.png", "02.png"], vec!["03.png", "04.png"]));
    noted(&dataset.notes, &["is_bad"]);
}

#[test]
fn views_for_validation_are_held_out_without_others() {
    let scene = Scene::new();
    (0..4).for_each(|index| scene.photo(&format!("images/{index:02}.png"), 12, 8));
    for (name, range) in [("train", 0..3), ("val", 3..4)] {
        scene.write(&format!("transforms_{name}.json"), format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frames(range)));
    }
    let dataset = open(&scene);
    assert_eq!((dataset.train.len(), names(&dataset.test)), (3, vec!["03.png"]));
    scene.write("transforms_test.json", format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frames(2..3)));
    scene.write("transforms_train.json", format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frames(0..2)));
    let dataset = open(&scene);
    assert_eq!((dataset.train.len(), names(&dataset.test)), (2, vec!["02.png"]));
    noted(&dataset.notes, &["transforms_val.json"]);
}

#[test]
fn lists_beside_a_model_hold_out() {
    for (file, text) in [
        ("sparse/0/test.txt", "02.png\n\n04\n"),
        ("test_list.txt", "\u{feff}# held out\r\nimages/02.png\r\nimages/04.png\r\n"),
        ("train_test_lists.json", r#"{"train": ["00.png", "01.png", "03.png"], "test": ["02.png", "04.png"]}"#),
    ] {
        let scene = simple(5);
        scene.write(file, text);
        let dataset = open(&scene);
        assert_eq!((dataset.train.len(), names(&dataset.test)), (3, vec!["02.png", "04.png"]), "{file}");
        noted(&dataset.notes, &[file]);
        fs::remove_file(scene.path().join(file)).expect("removed");
        assert_eq!(names(&open(&scene).test), ["00.png"]);
    }
}
