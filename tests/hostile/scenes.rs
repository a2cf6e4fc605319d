//! Inconsistent scenes, read up to the start of training.

use crate::scenes::fixtures::{ColmapCamera, Scene, images_bin, pinhole, refusal, simple};
use labelgs::Result;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::scene::Dataset;
use labelgs::scenes::{self, LoadOptions, initial_gaussians};

fn open(scene: &Scene, max_bad_photos: f32) -> Result<Dataset> {
    scenes::open(scene.path(), &LoadOptions { test_every: None, max_bad_photos, ..LoadOptions::default() })
}

#[test]
fn a_few_undecodable_photos_are_skipped_and_listed() {
    let scene = simple(20);
    scene.write("images/03.png", b"no picture");
    scene.write("images/11.png", b"");
    let dataset = open(&scene, 0.1).expect("2 of 20 are allowed");
    assert_eq!(dataset.train.len(), 18);
    assert!(dataset.train.iter().all(|view| view.name != "03.png" && view.name != "11.png"));
    let note = dataset.notes.iter().find(|note| note.contains("photos cannot be read")).expect("a note");
    assert!(note.contains("2 of 20") && note.contains("03.png") && note.contains("11.png"), "{note}");
    // The split into training and test views does not depend on skipped photos.
    let split = LoadOptions { test_every: Some(4), ..LoadOptions::default() };
    let dataset = scenes::open(scene.path(), &split).expect("a scene");
    let test: Vec<&str> = dataset.test.iter().map(|view| view.name.as_str()).collect();
    assert_eq!(test, ["00.png", "04.png", "08.png", "12.png", "16.png"]);
    assert!(refusal(open(&scene, 0.0)).contains("`max_bad_photos = 0` allows 0"));
    scene.write("images/12.png", b"no picture");
    let text = refusal(open(&scene, 0.1));
    let parts = ["3 of 20 photos cannot be read", "allows 2", "03.png", "11.png", "12.png"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    open(&scene, 0.15).expect("3 of 20 are allowed");
}

#[test]
fn many_undecodable_photos_are_listed_up_to_twenty() {
    let scene = simple(30);
    (0..25).for_each(|index| drop(scene.write(&format!("images/{index:02}.png"), b"no picture")));
    let text = refusal(open(&scene, 0.5));
    assert!(text.contains("25 of 30") && text.contains("19.png") && text.contains("and 5 more"), "{text}");
    assert!(!text.contains("20.png"), "{text}");
    (25..30).for_each(|index| drop(scene.write(&format!("images/{index:02}.png"), b"no picture")));
    assert!(refusal(open(&scene, 1.0)).contains("30 of 30"), "none is left");
    for share in [-0.1, 1.5, f32::NAN] {
        assert_eq!(exit_status(&open(&scene, share).expect_err("not a share")), 2);
    }
}

/// Sizes come from the photos here, so a damaged photo has no camera.
#[test]
fn an_undecodable_photo_of_transforms_is_skipped_too() {
    let scene = Scene::new();
    let pose = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
    let frame = |index: usize| format!(r#"{{"file_path": "images/{index:02}", "transform_matrix": {pose}}}"#);
    let frames: Vec<String> = (0..10).map(frame).collect();
    scene.write("transforms.json", format!(r#"{{"camera_angle_x": 1.0, "frames": [{}]}}"#, frames.join(",")));
    (0..10).for_each(|index| scene.photo(&format!("images/{index:02}.png"), 12, 8));
    scene.write("images/04.png", b"no picture");
    assert_eq!(open(&scene, 0.1).expect("one of ten is allowed").train.len(), 9);
    assert!(refusal(open(&scene, 0.05)).contains("04.png"));
}

#[test]
fn degenerate_intrinsics_are_refused_by_name() {
    let with = |size: (u64, u64), parameters: [f64; 4]| {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        let camera = ColmapCamera { size, parameters: parameters.to_vec(), ..pinhole() };
        scene.colmap_bin("sparse/0", &[camera], &["a.png"]);
        open(&scene, 0.0)
    };
    let cases: [((u64, u64), [f64; 4], &str); 10] = [
        ((12, 8), [0.0, 11.0, 6.0, 4.0], "must be positive"),
        ((12, 8), [10.0, -11.0, 6.0, 4.0], "must be positive"),
        ((12, 8), [f64::NAN, 11.0, 6.0, 4.0], "must be positive"),
        ((12, 8), [10.0, f64::INFINITY, 6.0, 4.0], "must be positive"),
        ((12, 8), [1e-9, 11.0, 6.0, 4.0], "180 degrees"),
        ((12, 8), [1e308, 1e308, 6.0, 4.0], "a million times"),
        ((12, 8), [10.0, 11.0, 600.0, 4.0], "principal point"),
        ((12, 8), [10.0, 11.0, 6.0, f64::NAN], "principal point"),
        ((0, 8), [10.0, 11.0, 0.0, 4.0], "image size 0 x 8"),
        ((1 << 40, 8), [10.0, 11.0, 6.0, 4.0], "1099511627776"),
    ];
    for (size, parameters, problem) in cases {
        let text = refusal(with(size, parameters));
        assert!(text.contains(problem) && text.contains("cameras.bin: camera 1"), "{parameters:?}: {text}");
    }
    with((12, 8), [10.0, 11.0, 6.0, 4.0]).expect("these are fine");
}

/// Degrees in place of radians: the tangent of some of them is positive.
#[test]
fn a_field_of_view_of_half_a_turn_or_more_is_refused() {
    for angle in ["3.1415926535897932", "3.2", "0", "-1", "7", "40", "60", "1e308", "1e-300"] {
        for side in ["camera_angle_x", "camera_angle_y"] {
            let scene = Scene::new();
            scene.photo("images/a.png", 12, 8);
            let pose = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
            let frame = format!(r#"{{"file_path": "images/a.png", "transform_matrix": {pose}}}"#);
            scene.write("transforms.json", format!(r#"{{"{side}": {angle}, "frames": [{frame}]}}"#));
            let text = refusal(open(&scene, 0.0));
            assert!(text.contains("transforms.json: frame 0"), "{side} {angle}: {text}");
        }
    }
}

#[test]
fn poses_that_overflow_are_refused_and_points_skipped() {
    let scene = simple(1);
    let path = scene.path().join("sparse/0/images.bin");
    for far in [1e13, 1e300, f64::MAX] {
        let mut bytes = images_bin(&["00.png"], 1);
        bytes[12 + 32..12 + 40].copy_from_slice(&f64::to_le_bytes(far));
        std::fs::write(&path, bytes).expect("written");
        assert!(refusal(open(&scene, 0.0)).contains("1e12 from the origin"));
    }
    std::fs::write(&path, images_bin(&["00.png"], 1)).expect("written");
    let points = scene.path().join("sparse/0/points3D.bin");
    let mut bytes = std::fs::read(&points).expect("bytes");
    bytes[16..24].copy_from_slice(&1e300_f64.to_le_bytes());
    std::fs::write(&points, bytes).expect("written");
    let dataset = open(&scene, 0.0).expect("a scene");
    assert_eq!(dataset.points.len(), 1);
    assert!(dataset.notes.iter().any(|note| note.contains("1 of 2 points")), "{:?}", dataset.notes);
}

#[test]
fn points_that_no_camera_sees_are_an_error_with_a_cure() {
    let scene = Scene::new();
    let names = ["00.png", "sub/b 1.png"];
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    let model = [
        ("cameras", super::seeds::colmap_cameras_bin()[0].clone()),
        ("images", super::seeds::colmap_images_bin()),
        ("points3D", super::seeds::colmap_points_bin()),
    ];
    model.iter().for_each(|(name, bytes)| drop(scene.write(&format!("sparse/0/{name}.bin"), bytes)));
    let mut dataset = open(&scene, 0.0).expect("a scene");
    assert_eq!(initial_gaussians(&dataset, 1, 10).expect("Gaussians").len(), dataset.points.len());
    // Mirrored through the first camera, all of them lie behind both.
    let camera = dataset.train[0].camera.clone();
    let back = camera.rotation.transpose() * glam::DVec3::new(0.0, 0.0, -1000.0);
    dataset.points.iter_mut().for_each(|point| point.position += back);
    let text = refusal(initial_gaussians(&dataset, 1, 10));
    assert!(text.contains("none of the 17 points") && text.contains("camera-to-world"), "{text}");
}

#[test]
fn a_text_model_of_another_encoding_names_the_line() {
    let scene = Scene::new();
    scene.photo("images/a.png", 12, 8);
    scene.colmap_txt("sparse/0", &[pinhole()], &["a.png"]);
    let mut bytes = b"# a comment\n".to_vec();
    bytes.extend("1 1 0 0 0 0 0 4 1 \u{e4}.png\n\n".encode_utf16().map(|unit| unit as u8));
    scene.write("sparse/0/images.txt", bytes);
    let text = refusal(open(&scene, 0.0));
    assert!(text.contains("images.txt: line 2") && text.contains("UTF-8"), "{text}");
}
