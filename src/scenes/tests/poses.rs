//! Poses of LLFF and Metashape, and the dialects of `transforms.json`.

use super::fixtures::*;
use super::{all, names, noted};
use glam::{DVec2, DVec3};
use labelgs_scene::{Camera, Dataset};
use labelgs_scenes::window::windows;
use labelgs_scenes::{self as scenes, Lookup};
use std::path::Path;

fn open(scene: &Path) -> labelgs_scene::Result<Dataset> {
    scenes::open(scene, &all())
}

/// A camera at (1, 2, 3) that looks along x of the world, with y of the world up.
fn check_pose(camera: &Camera) {
    assert!(camera.centre().distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12, "{:?}", camera.centre());
    assert!(camera.to_camera(DVec3::new(5.0, 2.0, 3.0)).distance(DVec3::new(0.0, 0.0, 4.0)) < 1e-12);
    assert!(camera.to_camera(DVec3::new(1.0, 3.0, 3.0)).distance(DVec3::new(0.0, -1.0, 0.0)) < 1e-12);
    assert!(camera.to_camera(DVec3::new(1.0, 2.0, 4.0)).distance(DVec3::new(1.0, 0.0, 0.0)) < 1e-12);
}

fn npy(shape: &str, values: &[f64]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    super::depths::npy("<f8", "False", shape, &bytes)
}

/// Down, right, backwards, centre, and height, width, focal length as columns; then two depths.
const LLFF_ROW: [f64; 17] = [0.0, 0.0, -1.0, 1.0, 8.0, -1.0, 0.0, 0.0, 2.0, 12.0, 0.0, 1.0, 0.0, 3.0, 10.0, 0.5, 90.0];

fn llff(bytes: &[u8], photos: usize) -> Scene {
    let scene = Scene::new();
    scene.write("poses_bounds.npy", bytes);
    (0..photos).for_each(|index| scene.photo(&format!("images/{index}.png"), 12, 8));
    scene
}

#[test]
fn poses_of_llff_turn_to_opencv() {
    let mut second = LLFF_ROW;
    second[3] = 7.0;
    let scene = llff(&npy("(2, 17)", &[LLFF_ROW, second].concat()), 2);
    scene.write("images/notes.txt", "no photo");
    for place in [scene.path().to_owned(), scene.path().join("poses_bounds.npy")] {
        let dataset = open(&place).expect("a scene");
        let names = names(&dataset.train);
        assert_eq!(names, ["0.png", "1.png"]);
        let camera = &dataset.train[0].camera;
        check_pose(camera);
        assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (10.0, 10.0, 6.0, 4.0));
        assert!((dataset.train[1].camera.centre().x - 7.0).abs() < 1e-12);
    }
}

#[test]
fn broken_poses_of_llff_name_the_row() {
    let broken = |bytes: &[u8], photos: usize| refusal(open(llff(bytes, photos).path()));
    let row = |at: usize, value: f64| {
        let mut row = LLFF_ROW;
        row[at] = value;
        npy("(1, 17)", &row)
    };
    assert!(broken(&npy("(1, 17)", &LLFF_ROW), 3).contains("holds 3 PNG or JPEG files"));
    assert!(broken(&npy("(1, 15)", &LLFF_ROW[..15]), 1).contains("(photos, 17)"));
    assert!(broken(&npy("(17,)", &LLFF_ROW), 1).contains("(photos, 17)"));
    assert!(broken(&npy("(1, 17)", &LLFF_ROW[..16]), 1).contains("136 bytes"));
    assert!(broken(&npy("(0, 17)", &[]), 1).contains("0 x 17"));
    assert!(broken(&npy("(99999999999, 99999999999)", &LLFF_ROW), 1).contains("99999999999"));
    assert!(broken(b"text", 1).contains("numpy"));
    assert!(broken(&row(1, 1.0), 1).contains("row 0 (`0.png`)"));
    assert!(broken(&row(0, f64::NAN), 1).contains("down, right and backwards"));
    assert!(broken(&row(4, 8.5), 1).contains("8.5"));
    assert!(broken(&row(14, 0.0), 1).contains("focal lengths"));
    assert!(broken(&row(3, f64::INFINITY), 1).contains("finite"));
    let scene = Scene::new();
    scene.write("poses_bounds.npy", npy("(1, 17)", &LLFF_ROW));
    assert!(refusal(open(scene.path())).contains("no such folder"));
}

const SENSOR_XML: &str = r#"<sensor id="0" type="frame"><resolution width="12" height="8"/>
<calibration class="initial"><resolution width="12" height="8"/><f>99</f></calibration>
<calibration type="frame" class="adjusted"><resolution width="12" height="8"/>
<f>10</f><cx>0.5</cx><cy>-0.25</cy><b1>0.5</b1><b2>0.2</b2><k1>0.1</k1><k2>0.01</k2><k3>0.001</k3><p1>0.002</p1><p2>-0.003</p2>
</calibration></sensor>"#;
/// The pose of [`check_pose`] in a chunk of half the size, shifted by (0, 0, 1).
const CAMERA_POSE: &str = "0 0 1 0.5  0 -1 0 1  1 0 0 1  0 0 0 1";
const CHUNK_XML: &str =
    "<transform><rotation>1 0 0 0 1 0 0 0 1</rotation><translation>0 0 1</translation><scale>2</scale></transform>";

fn metashape(sensor: &str, cameras: &str, more: &str) -> Scene {
    let scene = Scene::new();
    ["a.png", "b.png"].iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    let text = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="Chunk 1" enabled="true"><sensors>{sensor}</sensors>
{more}<cameras>{cameras}</cameras></chunk></document>"#
    );
    scene.write("cameras.xml", text);
    scene
}

fn of_camera(label: &str, transform: &str) -> String {
    format!(
        r#"<camera id="0" sensor_id="0" component_id="0" label="{label}"><transform>{transform}</transform></camera>"#
    )
}

/// Where the photo `a.png` shows a point given in camera axes.
fn pixel(scene: &Scene, point: DVec3) -> DVec2 {
    let windows = windows(scene.path(), &Lookup::default()).expect("windows");
    windows["a.png"].optics.pixel(point).expect("seen")
}

#[test]
fn cameras_of_metashape_are_read_with_their_lens() {
    let group = format!(r#"<group id="0">{}</group>"#, of_camera("b.png", CAMERA_POSE));
    let odd = r#"<camera id="7" sensor_id="0" label="c"/><camera id="8" sensor_id="0" label="d" enabled="false"/>"#;
    let component = format!(r#"<components><component id="0">{CHUNK_XML}</component></components>"#);
    for more in [CHUNK_XML, &component] {
        let scene = metashape(SENSOR_XML, &[&of_camera("a", CAMERA_POSE), &group, odd].concat(), more);
        for place in [scene.path().to_owned(), scene.path().join("cameras.xml")] {
            let dataset = open(&place).expect("a scene");
            let names = names(&dataset.train);
            assert_eq!(names, ["a.png", "b.png"]);
            for what in ["1 camera of", "disabled", "without a pose"] {
                noted(&dataset.notes, &[what]);
            }
            let camera = &dataset.train[0].camera;
            check_pose(camera);
            assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (10.5, 10.0, 6.5, 3.75));
        }
        // The formulas of Metashape's manual, at (0.3, -0.2, 1).
        let (x, y, r2) = (0.3, -0.2, 0.13_f64);
        let radial = 1.0 + 0.1 * r2 + 0.01 * r2 * r2 + 0.001 * r2.powi(3);
        let bent_x = x * radial + 0.002 * (r2 + 2.0 * x * x) + 2.0 * -0.003 * x * y;
        let bent_y = y * radial + -0.003 * (r2 + 2.0 * y * y) + 2.0 * 0.002 * x * y;
        let expected = DVec2::new(6.0 + 0.5 + bent_x * 10.0 + bent_x * 0.5 + bent_y * 0.2, 4.0 - 0.25 + bent_y * 10.0);
        let found = pixel(&scene, DVec3::new(x, y, 1.0));
        assert!(found.distance(expected) < 1e-12, "{found} {expected}");
    }
}

#[test]
fn metashape_has_fisheyes_and_panoramas() {
    let fisheye = SENSOR_XML.replace("type=\"frame\"", "type=\"fisheye\"");
    let scene = metashape(&fisheye, &of_camera("a", CAMERA_POSE), "");
    assert_eq!(open(scene.path()).expect("a scene").train.len(), 1);
    let (x, y) = (0.3_f64, -0.2);
    let factor = x.hypot(y).atan() / x.hypot(y);
    let at = DVec2::new(x, y) * factor;
    let a2 = at.length_squared();
    let radial = 1.0 + 0.1 * a2 + 0.01 * a2 * a2 + 0.001 * a2.powi(3);
    let bent = at.y * radial - 0.003 * (a2 + 2.0 * at.y * at.y) + 2.0 * 0.002 * at.x * at.y;
    let found = pixel(&scene, DVec3::new(x, y, 1.0));
    assert!((found.y - (3.75 + bent * 10.0)).abs() < 1e-12, "{found}");
    let spherical = r#"<sensor id="0" type="spherical"><resolution width="12" height="8"/></sensor>"#;
    let dataset = open(metashape(spherical, &of_camera("a", CAMERA_POSE), "").path()).expect("a scene");
    assert_eq!(dataset.train.len(), 6);
}

/// A slave is where its sensor is mounted in the master's frame, unless it has its own pose.
#[test]
fn slaves_of_a_rig_follow_their_master() {
    // Turned by a quarter about y, so that it looks along the master's x; half a chunk unit to the right of it.
    let mounting = "<rotation>0 0 1 0 1 0 -1 0 0</rotation><location>0.5 0 0</location>";
    let slave_sensor = |mounting: &str| {
        SENSOR_XML.replace("id=\"0\"", "id=\"1\" master_id=\"0\"").replace("</sensor>", &format!("{mounting}</sensor>"))
    };
    let slave = r#"<camera id="1" sensor_id="1" master_id="0" component_id="0" label="b"/>"#;
    let cameras = [&of_camera("a", CAMERA_POSE), slave].concat();
    let dataset =
        open(metashape(&[SENSOR_XML, &slave_sensor(mounting)].concat(), &cameras, CHUNK_XML).path()).expect("a scene");
    let [master, slave_view] = &dataset.train[..] else { panic!("two views") };
    check_pose(&master.camera);
    // The same point in the slave's and the master's frame, in world units, which are half the chunk's.
    for point in [DVec3::new(0.3, -0.2, 2.0), DVec3::new(-1.0, 0.5, 4.0)] {
        let in_master = DVec3::new(point.z + 1.0, point.y, -point.x);
        let (rotation, translation) = (master.camera.rotation, master.camera.translation);
        let world = rotation.transpose() * (in_master - translation);
        assert!(slave_view.camera.to_camera(world).distance(point) < 1e-9, "{point}");
    }
    noted(&dataset.notes, &["1 camera of", "rig"]);
    // Unmounted slaves are named; a slave's own pose takes precedence.
    let unmounted = [SENSOR_XML, &slave_sensor(r#"<rotation fixed="true"/><location fixed="true"/>"#)].concat();
    let text = refusal(open(metashape(&unmounted, &cameras, "").path()));
    assert!(text.contains("slave of a rig") && text.contains("without the rig"), "{text}");
    let own = slave.replace("/>", &format!("><transform>{CAMERA_POSE}</transform></camera>"));
    let dataset =
        open(metashape(&unmounted, &[of_camera("a", CAMERA_POSE), own].concat(), CHUNK_XML).path()).expect("a scene");
    check_pose(&dataset.train[1].camera);
}

/// A second camera with unaligned photos has no calibration.
#[test]
fn sensors_that_no_pose_uses_do_not_matter() {
    let unused = r#"<sensor id="1" type="frame"><resolution width="12" height="8"/></sensor>"#;
    let other = r#"<camera id="7" sensor_id="1" label="c"/>"#;
    let scene = metashape(&[SENSOR_XML, unused].concat(), &[&of_camera("a", CAMERA_POSE), other].concat(), "");
    assert_eq!(open(scene.path()).expect("a scene").train.len(), 1);
    let used = [
        &of_camera("a", CAMERA_POSE),
        r#"<camera id="7" sensor_id="1" label="c"><transform>"#,
        CAMERA_POSE,
        "</transform></camera>",
    ];
    let scene = metashape(&[SENSOR_XML, unused].concat(), &used.concat(), "");
    assert!(refusal(open(scene.path())).contains("no `calibration`"));
}

#[test]
fn broken_xml_names_the_line() {
    let one = |sensor: &str, camera: &str| refusal(open(metashape(sensor, camera, "").path()));
    let good = of_camera("a", CAMERA_POSE);
    assert!(one("<sensor>", &good).contains("line"));
    assert!(one("", &good).contains("line 3, camera `a`"));
    assert!(one(&SENSOR_XML.replace("frame", "rpc"), &good).contains("type rpc"));
    assert!(one(&SENSOR_XML.replace("<f>10</f>", "<f>ten</f>"), &good).contains("`f` does not hold 1 finite number"));
    assert!(one(&SENSOR_XML.replace("<f>10</f>", ""), &good).contains("focal lengths"));
    assert!(one(&SENSOR_XML.replace("width=\"12\"", "width=\"x\""), &good).contains("image side"));
    assert!(one(&SENSOR_XML.replace("<k1>0.1", "<k1>1e999"), &good).contains("finite"));
    assert!(one(r#"<sensor id="0"/>"#, &good).contains("resolution"));
    assert!(one(SENSOR_XML, &of_camera("a", "1 2 3")).contains("16 finite numbers"));
    assert!(one(SENSOR_XML, &of_camera("a", "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1")).contains("not a rotation"));
    assert!(one(SENSOR_XML, &of_camera("../a", CAMERA_POSE)).contains("outside"));
    assert!(one(SENSOR_XML, &[good.clone(), good.clone()].concat()).contains("same label"));
    assert!(one(SENSOR_XML, "").contains("lists no photo"));
    let unaligned = one(SENSOR_XML, r#"<camera id="7" sensor_id="0" label="c"/>"#);
    assert!(unaligned.contains("lists no photo") && unaligned.contains("1 camera of"), "{unaligned}");
    assert!(one(&SENSOR_XML.replace("<f>10</f>", "<f>10</f><p3>0.1</p3>"), &good).contains("p3"));
    let typed = SENSOR_XML.replace("calibration type=\"frame\"", "calibration type=\"fisheye\"");
    assert!(one(&typed, &good).contains("of type frame, but its calibration of type fisheye"));
    let other = format!(r#"<components><component id="3">{CHUNK_XML}</component></components>"#);
    assert!(refusal(open(metashape(SENSOR_XML, &good, &other).path())).contains("names no component"));
    let of_text = |text: &str| {
        let scene = Scene::new();
        scene.write("x.xml", text);
        refusal(open(scene.path()))
    };
    assert!(of_text("<a/>").contains("`chunk`"));
    assert!(of_text("").contains("Metashape"));
    let bomb = r#"<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><a>&b;</a>"#;
    assert!(of_text(bomb).contains("line"), "{}", of_text(bomb));
    assert!(of_text(&"<a>".repeat(100_000)).contains("line"));
    let two = metashape(SENSOR_XML, &good, "");
    two.write("other.xml", "<a/>");
    assert!(refusal(open(two.path())).contains("not the only such file"));
}

/// The fields that the apps write, including those that labelgs uses.
#[test]
fn transforms_of_phones_are_read() {
    let pose = "[[0,0,-1,1],[0,1,0,2],[1,0,0,3],[0,0,0,1]]";
    let polycam = format!(
        r#"{{"camera_model": "OPENCV", "ply_file_path": "sparse_pc.ply", "frames": [{{"file_path": "./images/a.png",
        "depth_file_path": "./depth/a.png", "mask_path": null, "fl_x": 10.5, "fl_y": 10, "cx": 6.5, "cy": 4, "w": 12, "h": 8,
        "blur_score": 33.1, "transform_matrix": {pose}}}]}}"#
    );
    let record3d = format!(
        r#"{{"fl_x": 10.5, "fl_y": 10.0, "cx": 6.5, "cy": 4.0, "w": 12.0, "h": 8.0, "aabb_scale": 4, "scale": 0.5,
        "camera_angle_x": 1.03, "camera_angle_y": 0.76, "enable_depth_loading": true, "integer_depth_scale": 0.001,
        "frames": [{{"file_path": "images/a", "depth_path": "depth/a.png", "transform_matrix": {pose}}}]}}"#
    );
    let luma = format!(
        r#"{{"camera_angle_x": 1.03, "fl_x": 10.5, "fl_y": 10, "cx": 6.5, "cy": 4, "w": 12, "h": 8, "k1": 0, "k2": 0.0,
        "p1": 0, "p2": 0, "is_fisheye": false, "aabb": [[-1,-1,-1],[1,1,1]], "offset": [0.5, 0.5, 0.5], "n_extra": null,
        "frames": [{{"file_path": "images/a.png", "sharpness": 20.0, "transform_matrix": {pose}}}]}}"#
    );
    for (text, missing) in [(polycam, true), (record3d, false), (luma, false)] {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.write("transforms.json", &text);
        let dataset = open(scene.path()).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let view = &dataset.train[0];
        check_pose(&view.camera);
        assert_eq!((view.name.as_str(), view.camera.fx, view.camera.fy, view.camera.cx), ("a.png", 10.5, 10.0, 6.5));
        assert_eq!(dataset.notes.iter().any(|note| note.contains("ply_file_path")), missing);
    }
}
