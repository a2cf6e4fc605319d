//! A camera from a JSON file, and the list of all cameras.

use super::fixtures::{Scene, refusal};
use glam::{DMat3, DVec3};
use labelgs_scene::Camera;
use labelgs_scenes::camera_json;
use std::fs;

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
    // World-from-camera is the transpose: its first row is (0, -1, 0); the centre is minus that times (1, 2, 3).
    assert_eq!(list[0]["rotation"][0], serde_json::json!([0.0, -1.0, 0.0]));
    assert_eq!(list[0]["position"], serde_json::json!([2.0, -1.0, -3.0]));
    assert_eq!(list[0]["cx"], 3.0);
}
