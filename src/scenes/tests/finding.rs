//! Photos that are not at their listed paths, missing photos, and files that are not photos.

use super::fixtures::*;
use super::{all, names, open};
use labelgs_scene::Dataset;
use labelgs_scene::Error;
use labelgs_scenes::{self as scenes, LoadOptions, Lookup};
use std::fs;

fn open_with(scene: &Scene, images: &str) -> labelgs_scene::Result<Dataset> {
    let lookup = Lookup { images: Some(images.into()), ..Lookup::default() };
    scenes::open(scene.path(), &LoadOptions { lookup, ..all() })
}

/// A scene whose photos, listed as `images/NAME` or `NAME`, were moved or renamed.
fn moved(listed: &[&str], stored: &[&str]) -> Scene {
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[pinhole()], listed);
    stored.iter().for_each(|name| scene.photo(name, 12, 8));
    scene
}

#[test]
fn photos_are_found_where_programs_put_them() {
    let cases: [(&[&str], &[&str]); 8] = [
        (&["a.png", "b.png"], &["images_8/a.png", "images_8/b.png"]),
        (&["a.png", "b.png"], &["input/a.jpg", "input/b.jpg"]),
        (&["a.png", "b.png"], &["images/a.jpg", "images/b.JPEG"]),
        (&["A.PNG", "b.png"], &["images/a.png", "images/B.png"]),
        (&["caf\u{e9}.png", "b.png"], &["images/cafe\u{301}.png", "images/b.png"]),
        (&["images/a.png", "images/b.png"], &["a.png", "b.png"]),
        (&["left/a.png", "right/a.png"], &["images_2/Left/a.png", "images_2/Right/a.png"]),
        (&["a", "b"], &["images/a.png", "images/b.png"]),
    ];
    for (listed, stored) in cases {
        let dataset = open(&moved(listed, stored)).unwrap_or_else(|error| panic!("{stored:?}: {error}"));
        let names = names(&dataset.train);
        assert_eq!(names.len(), 2, "{stored:?}");
        assert!(dataset.train.iter().all(|view| view.photo.is_some()));
    }
    let dataset = open(&moved(&["a.png", "b.png"], &["input/a.png", "input/b.png"])).expect("a scene");
    let notes: Vec<_> = dataset.notes.iter().filter(|note| note.contains("found by name")).collect();
    assert!(notes.len() == 1 && notes[0].contains("a.png is input/a.png"), "{notes:?}");
}

#[test]
fn a_match_that_is_not_the_only_one_does_not_count() {
    // If other photos are in the listed folder, a smaller copy elsewhere is not used.
    let scene = moved(&["a.png", "b.png", "c.png", "d.png"], &["images/a.png", "images/b.png", "images/c.png"]);
    scene.photo("images_8/d.png", 12, 8);
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.train.len(), 3);
    let two = moved(&["a.tiff", "b.png", "c.png", "d.png"], &["images/b.png", "images/c.png", "images/d.png"]);
    two.photo("images/a.png", 12, 8);
    two.photo("images/a.jpg", 12, 8);
    assert_eq!(open(&two).expect("a scene").train.len(), 3);
    // Two listed photos with the same file.
    let one = moved(&["a.png", "a.jpg"], &["images/A.jpeg"]);
    let text = refusal(open(&one));
    assert!(text.contains("only file") && text.contains("`images`"), "{text}");
}

#[test]
fn the_folder_of_photos_can_be_named() {
    let scene = moved(&["x/a.png", "x/b.png"], &["elsewhere/a.png", "elsewhere/b.png"]);
    let text = refusal(open(&scene));
    assert!(text.contains("2 of 2") && text.contains("elsewhere (2)") && text.contains("`images`"), "{text}");
    for folder in ["elsewhere".to_owned(), scene.path().join("elsewhere").display().to_string()] {
        assert_eq!(open_with(&scene, &folder).expect("a scene").train.len(), 2, "{folder}");
    }
    let error = open_with(&scene, "nowhere").expect_err("no folder");
    assert!(matches!(error, Error::Usage { .. }));
    assert!(error.to_string().contains("nowhere is not a folder"), "{error}");
}

#[test]
fn a_third_of_the_photos_may_lack() {
    let scene = simple(12);
    let remove = |index: usize| fs::remove_file(scene.path().join(format!("images/{index:02}.png"))).expect("removed");
    (0..4).for_each(remove);
    let dataset = open(&scene).expect("a scene");
    assert_eq!((dataset.train.len(), dataset.flaws.len()), (8, 1));
    remove(4);
    let text = refusal(open(&scene));
    assert!(text.contains("5 of 12") && text.contains("up to 4") && text.contains("`max_bad_photos`"), "{text}");
    let most = LoadOptions { max_bad_photos: 0.5, ..all() };
    assert_eq!(scenes::open(scene.path(), &most).expect("a scene").train.len(), 7);
}

#[test]
fn what_is_no_photo_is_called_by_what_it_is() {
    let cases: [(&[u8], &str); 4] = [
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "git lfs pull"),
        (b"<!DOCTYPE html><html></html>", "web page"),
        (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "HEIC"),
        (b"II*\0\x08\0\0\0", "TIFF"),
    ];
    for (bytes, expected) in cases {
        let scene = simple(1);
        scene.write("images/00.png", bytes);
        let text = refusal(open(&scene));
        assert!(text.contains(expected) && text.contains("not a PNG or JPEG"), "{text}");
    }
}

#[test]
fn a_folder_of_photos_and_a_video_are_answered_with_the_way_to_poses() {
    let scene = Scene::new();
    scene.photo("pictures/a.png", 12, 8);
    let text = refusal(open(&scene));
    assert!(text.contains("pictures holds 1 photo without poses: the command `photos`"), "{text}");
    let video = scene.write("clip.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2");
    let text = refusal(scenes::open(&video, &LoadOptions::default()));
    assert!(text.contains("a video") && text.contains("the command `photos`"), "{text}");
}
