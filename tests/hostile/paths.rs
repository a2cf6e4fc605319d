//! Paths that leave the folder of the scene.

use crate::scenes::fixtures::{Scene, images_bin, pinhole, refusal};
use labelgs::Result;
use labelgs::scene::Dataset;
use labelgs::scenes::{self, LoadOptions};
use std::path::Path;

const IDENTITY_MATRIX: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

fn open(scene: &Path, allow_outside: bool) -> Result<Dataset> {
    scenes::open(
        scene,
        &LoadOptions {
            test_every: None,
            lookup: labelgs::scenes::Lookup { allow_outside, ..Default::default() },
            ..LoadOptions::default()
        },
    )
}

fn names(dataset: &Dataset) -> Vec<&str> {
    dataset.train.iter().map(|view| view.name.as_str()).collect()
}

/// A folder with a photo `photos/a.png` and an empty folder `scene` beside it.
fn outside() -> Scene {
    let around = Scene::new();
    around.photo("photos/a.png", 12, 8);
    std::fs::create_dir_all(around.path().join("scene")).expect("a folder");
    around
}

#[test]
fn colmap_names_that_leave_the_scene_need_the_flag() {
    let around = outside();
    let absolute = around.path().join("photos/a.png").to_str().expect("UTF-8").to_owned();
    for listed in ["../photos/a.png", "..\\photos\\a.png", absolute.as_str()] {
        around.colmap_bin("scene/sparse/0", &[pinhole()], &["x"]);
        around.write("scene/sparse/0/images.bin", images_bin(&[listed], 1));
        let scene = around.path().join("scene");
        let text = refusal(open(&scene, false));
        let named = text.contains("outside the scene") && text.contains("allow_outside") && text.contains("a.png");
        assert!(named && text.contains("images.bin"), "{text}");
        let dataset = open(&scene, true).expect("the flag allows it");
        assert!(dataset.train[0].photo.is_some(), "the photo was read");
        let name = names(&dataset)[0].to_owned();
        assert!(name.ends_with("photos/a.png") && !name.contains("..") && !name.starts_with('/'), "{name}");
    }
}

#[test]
fn transforms_that_leave_the_scene_need_the_flag() {
    let around = outside();
    let absolute = around.path().join("photos/a.png").to_str().expect("UTF-8").to_owned();
    for listed in ["../photos/a.png", "..\\\\photos\\\\a", absolute.as_str()] {
        let frame = format!(r#"{{"file_path": "{listed}", "transform_matrix": {IDENTITY_MATRIX}}}"#);
        around.write("scene/transforms.json", format!(r#"{{"fl_x": 10, "frames": [{frame}]}}"#));
        let scene = around.path().join("scene");
        let text = refusal(open(&scene, false));
        assert!(text.contains("outside the scene") && text.contains("transforms.json"), "{text}");
        let dataset = open(&scene, true).expect("the flag allows it");
        assert!(dataset.train[0].photo.is_some(), "the photo was read");
        assert!(names(&dataset)[0].ends_with("photos/a.png"), "{:?}", names(&dataset));
        assert!(!dataset.train[0].stem().contains(['/', '\\']), "{}", dataset.train[0].stem());
    }
}

#[test]
fn drives_of_windows_are_absolute_here_too() {
    let scene = Scene::new();
    for listed in ["C:\\\\photos\\\\a.png", "d:/a.png", "\\\\\\\\server\\\\share\\\\a.png"] {
        let frame = format!(r#"{{"file_path": "{listed}", "w": 12, "h": 8, "transform_matrix": {IDENTITY_MATRIX}}}"#);
        scene.write("transforms.json", format!(r#"{{"fl_x": 10, "frames": [{frame}]}}"#));
        assert!(refusal(open(scene.path(), false)).contains("outside the scene"), "{listed}");
    }
}

#[test]
fn points_that_leave_the_scene_need_the_flag() {
    let around = outside();
    let cloud = &super::seeds::ply_cloud()[0];
    around.write("points.ply", cloud);
    around.photo("scene/images/a.png", 12, 8);
    let frame = format!(r#"{{"file_path": "images/a.png", "transform_matrix": {IDENTITY_MATRIX}}}"#);
    let text = format!(r#"{{"fl_x": 10, "ply_file_path": "../points.ply", "frames": [{frame}]}}"#);
    around.write("scene/transforms.json", text);
    let scene = around.path().join("scene");
    assert!(refusal(open(&scene, false)).contains("../points.ply"));
    assert_eq!(open(&scene, true).expect("the flag allows it").points.len(), 2);
}

#[test]
fn one_name_for_two_photos_is_an_error() {
    let around = outside();
    around.photo("scene/photos/a.png", 12, 8);
    let frame = |name: &str| format!(r#"{{"file_path": "{name}", "transform_matrix": {IDENTITY_MATRIX}}}"#);
    let frames = [frame("photos/a.png"), frame("../photos/a.png")].join(",");
    around.write("scene/transforms.json", format!(r#"{{"fl_x": 10, "frames": [{frames}]}}"#));
    let text = refusal(open(&around.path().join("scene"), true));
    assert!(text.contains("another photo is also called `photos/a.png`") && text.contains("frame 1"), "{text}");
}

#[test]
fn names_that_are_no_files_are_refused() {
    let scene = Scene::new();
    let refused = |name: &str, allow: bool| {
        let frame = format!(r#"{{"file_path": "{name}", "w": 12, "h": 8, "transform_matrix": {IDENTITY_MATRIX}}}"#);
        scene.write("transforms.json", format!(r#"{{"fl_x": 10, "frames": [{frame}]}}"#));
        open(scene.path(), allow)
    };
    assert!(refusal(refused("images", false)).contains("1 of 1 listed photos do not exist"));
    // A name that consists of a prefix only once caused a panic.
    let cameras = LoadOptions { photos: false, test_every: None, ..LoadOptions::default() };
    assert_eq!(names(&scenes::open(scene.path(), &cameras).expect("cameras are enough")), ["images"]);
    scene.photo("images/images.png", 12, 8);
    assert_eq!(names(&refused("images", false).expect("images.png in images")), ["images.png"]);
    for name in ["", ".", "./", "/", "..", "a\\u0000b"] {
        for allow in [false, true] {
            let text = refusal(refused(name, allow));
            assert!(text.contains("not a file path"), "`{name}`: {text}");
        }
    }
}

/// Links may lead out of the scene, because the user made them.
#[cfg(unix)]
#[test]
fn links_in_a_scene_are_followed() {
    let around = outside();
    std::os::unix::fs::symlink(around.path().join("photos"), around.path().join("scene/images")).expect("a link");
    around.colmap_bin("scene/sparse/0", &[pinhole()], &["a.png"]);
    let dataset = open(&around.path().join("scene"), false).expect("a scene");
    assert!(dataset.train[0].photo.is_some());
}
