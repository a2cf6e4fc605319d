//! A camera and a camera path from JSON files, and the list of all cameras.

use super::fixtures::{Scene, refusal};
use glam::{DMat3, DVec3};
use labelgs_scene::Camera;
use labelgs_scenes::{camera_json, camera_path::read_path};
use std::fs;
use std::path::Path;

#[test]
fn cameras_are_read_and_listed() {
    let scene = Scene::new();
    let text = r#"{"w2c": [[0,1,0,1],[-1,0,0,2],[0,0,1,3],[0,0,0,1]], "fx": 10.5, "fy": 11, "cx": 3, "cy": 2.5, "W": 6, "H": 5}"#;
    let camera = camera_json::read_camera(scene.write("cam.json", text)).expect("a camera");
    let rotation = DMat3::from_cols(DVec3::new(0.0, -1.0, 0.0), DVec3::new(1.0, 0.0, 0.0), DVec3::Z);
    let expected = Camera {
        rotation,
        translation: DVec3::new(1.0, 2.0, 3.0),
        fx: 10.5,
        fy: 11.0,
        cx: 3.0,
        cy: 2.5,
        width: 6,
        height: 5,
    };
    assert!(camera.rotation.abs_diff_eq(rotation, 1e-15));
    assert_eq!(Camera { rotation, ..camera.clone() }, expected);
    for (from, to) in
        [("[0,0,1,3]", "[0,0,-1,3]"), ("\"W\": 6", "\"W\": 0"), ("10.5", "-1"), ("\"fy\": 11,", ""), ("[-1,", "[-2,")]
    {
        refusal(camera_json::read_camera(scene.write("bad.json", text.replace(from, to))));
    }
    camera_json::write_cameras(scene.at("cameras.json"), &[("a.png", &expected), ("b.png", &expected)])
        .expect("written");
    let list: serde_json::Value =
        serde_json::from_slice(&fs::read(scene.at("cameras.json")).expect("bytes")).expect("JSON");
    assert_eq!(list[1]["id"], 1);
    assert_eq!(list[1]["img_name"], "b.png");
    // World-from-camera is the transpose: its first row is (0, -1, 0); the centre is its negative times (1, 2, 3).
    assert_eq!(list[0]["rotation"][0], serde_json::json!([0.0, -1.0, 0.0]));
    assert_eq!(list[0]["position"], serde_json::json!([2.0, -1.0, -3.0]));
    assert_eq!(list[0]["cx"], 3.0);
}

#[test]
fn paths_pass_their_keyframes() {
    let scene = Scene::new();
    let camera = |x: f64| {
        format!(
            r#"{{"w2c": [[1,0,0,{x}],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "fx": 10, "fy": 10, "cx": 3, "cy": 2, "W": 6, "H": 4}}"#
        )
    };
    let key = |time: f64, x: f64| format!(r#"{{"time": {time}, "camera": {}}}"#, camera(x));
    let text = |keys: &[String]| format!(r#"{{"schema_version": 1, "fps": 4, "keyframes": [{}]}}"#, keys.join(", "));
    let good = text(&[key(2.0, 0.0), key(2.5, 4.0), key(3.0, 5.0)]);
    let found = read_path(Path::new(&scene.write("path.json", &good))).expect("a path");
    let single = |x: f64| camera_json::read_camera(scene.write("cam.json", camera(x))).expect("a camera");
    assert_eq!((found.per_second, found.cameras.len()), (4.0, 5));
    assert_eq!([0, 2, 4].map(|at| found.cameras[at].clone()), [0.0, 4.0, 5.0].map(single));
    assert!(found.cameras.windows(2).all(|pair| pair[0].translation.x < pair[1].translation.x));

    let refused = |text: String, parts: &[&str]| {
        let error = refusal(read_path(Path::new(&scene.write("bad.json", text))));
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    refused(good.replace("2.5", "2"), &["keyframes: number 1 is at 2 s, after 2 s"]);
    refused(good.replace("\"fps\": 4", "\"fps\": 0"), &["fps: 1 s of 0 frames per second"]);
    refused(good.replace("[[1,0,0,5]", "[[9,0,0,5]"), &["keyframe 2: w2c: is not a camera-from-world pose"]);
    refused(good.replace("\"schema_version\": 1", "\"schema_version\": 2"), &["version 2"]);
    refused(text(&[]), &["keyframes: there is none"]);
    refused("[]".to_owned(), &["expected {\"schema_version\": 1, \"fps\""]);
}
