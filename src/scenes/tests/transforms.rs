//! `transforms.json` of Blender, instant-ngp and nerfstudio.

use super::fixtures::*;
use super::{names, noted};
use glam::DVec3;
use labelgs_scene::Dataset;
use labelgs_scenes::{self as scenes, LoadOptions};

const IDENTITY_MATRIX: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

fn open(scene: &Scene) -> labelgs_scene::Result<Dataset> {
    scenes::open(scene.path(), &LoadOptions::default())
}

fn frame(name: &str, more: &str) -> String {
    format!(r#"{{"file_path": "{name}", "transform_matrix": {IDENTITY_MATRIX}{more}}}"#)
}

#[test]
fn blender_uses_the_given_split_and_blends_alpha() {
    let scene = Scene::new();
    let texel = |x: u32, _| image::Rgba([200, 100, 50, if x == 0 { 0 } else { 128 }]);
    for name in ["train/r_0.png", "train/r_10.png", "test/r_0.png"] {
        image::RgbaImage::from_fn(4, 4, texel).save(scene.at(name)).expect("a photo");
    }
    let text = |names: &[&str]| {
        let frames: Vec<String> = names.iter().map(|name| frame(name, r#", "rotation": 0.1"#)).collect();
        format!(r#"{{"camera_angle_x": 1.0, "frames": [{}]}}"#, frames.join(","))
    };
    scene.write("transforms_train.json", text(&["./train/r_10", "./train/r_0"]));
    scene.write("transforms_test.json", text(&["./test/r_0"]));
    let options = LoadOptions { background: [1.0, 1.0, 0.0], test_every: Some(2), ..LoadOptions::default() };
    let dataset = scenes::open(scene.path(), &options).expect("a scene");
    let names = names(&dataset.train);
    assert_eq!((names, dataset.test[0].name.as_str()), (vec!["train/r_0.png", "train/r_10.png"], "test/r_0.png"));
    let view = &dataset.train[0];
    let focal = 2.0 / 0.5f64.tan();
    assert!((view.camera.fx - focal).abs() < 1e-12 && (view.camera.fy - focal).abs() < 1e-12);
    assert_eq!((view.camera.cx, view.camera.cy), (2.0, 2.0));
    let photo = view.photo().expect("a photo");
    assert_eq!(photo.rgba[0], [255, 255, 0, 255]);
    let half = |c: f64, b: f64| (c * 128.0 / 255.0 + b * 127.0 / 255.0).round() as u8;
    assert_eq!(photo.rgba[1], [half(200.0, 255.0), half(100.0, 255.0), half(50.0, 0.0), 255]);
}

#[test]
fn poses_turn_from_opengl_to_opencv() {
    let scene = Scene::new();
    scene.photo("images/a.png", 12, 8);
    let matrix = "[[0,0,1,5],[1,0,0,6],[0,1,0,7],[0,0,0,1]]";
    let text = format!(r#"{{"fl_x": 10, "frames": [{{"file_path": "images/a.png", "transform_matrix": {matrix}}}]}}"#);
    scene.write("transforms.json", text);
    let dataset = open(&scene).expect("a scene");
    let camera = &dataset.train[0].camera;
    assert!(camera.centre().distance(DVec3::new(5.0, 6.0, 7.0)) < 1e-12);
    // The third column is the axis that points backwards: here the camera looks along -x of the world.
    assert!(camera.to_camera(DVec3::new(3.0, 6.0, 7.0)).distance(DVec3::new(0.0, 0.0, 2.0)) < 1e-12);
    // The second column points up in the image, where y is negative.
    assert!(camera.to_camera(DVec3::new(5.0, 6.0, 8.0)).distance(DVec3::new(0.0, -1.0, 0.0)) < 1e-12);
    assert_eq!((camera.fx, camera.fy, dataset.train[0].name.as_str()), (10.0, 10.0, "a.png"));
}

#[test]
fn frames_override_the_file() {
    let scene = Scene::new();
    ["images/a.png", "images/b.png"].iter().for_each(|name| scene.photo(name, 12, 8));
    let frames = [
        frame("images/a.png", r#", "fl_x": 20.0, "fl_y": 21.0, "cx": 5.0, "cy": 3.0, "k1": 0.1"#),
        frame("images\\\\b.png", ""),
        frame("./images/a.png", ""),
        frame("images/gone.png", r#", "w": 12, "h": 8"#),
    ];
    let global =
        r#""fl_x": 10.0, "w": 12.0, "h": 8.0, "cx": 6.5, "cy": 4.5, "camera_model": "OPENCV", "aabb_scale": 4"#;
    scene.write("transforms.json", format!(r#"{{{global}, "frames": [{}]}}"#, frames.join(",")));
    let dataset = super::open(&scene).expect("a scene");
    let [a, b] = &dataset.train[..] else { panic!("two views") };
    assert_eq!((a.camera.fx, a.camera.fy, a.camera.cx, a.camera.cy), (20.0, 21.0, 5.0, 3.0));
    assert_eq!((b.camera.fx, b.camera.fy, b.camera.cx, b.camera.cy), (10.0, 10.0, 6.5, 4.5));
    noted(&dataset.notes, &["second time"]);
    noted(&dataset.notes, &["1 of 3 listed photos do not exist"]);
}

#[test]
fn points_come_from_the_ply_in_the_world_of_the_poses() {
    let points = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n\
                  property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 -3 1 2 3\n0.2 0 -4 4 5 6\n";
    // Seen by a camera at the origin that looks along -z; the second list is the same before `applied_transform`.
    let turned = points.replace("0 0 -3", "0 -3 0").replace("0.2 0 -4", "0.2 -4 0");
    for (text, applied, notes) in [
        (points, "", 0),
        (points, r#""applied_transform": [[1,0,0,0],[0,0,-1,0],[0,1,0,0]],"#, 0),
        (turned.as_str(), r#""applied_transform": [[1,0,0,0],[0,0,-1,0],[0,1,0,0]],"#, 1),
    ] {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.write("sparse_pc.ply", text);
        let frames = frame("images/a.png", "");
        scene.write(
            "transforms.json",
            format!(r#"{{"fl_x": 10, {applied} "ply_file_path": "sparse_pc.ply", "frames": [{frames}]}}"#),
        );
        let dataset = open(&scene).expect("a scene");
        let positions: Vec<DVec3> = dataset.points.iter().map(|point| point.position).collect();
        assert_eq!(positions, [DVec3::new(0.0, 0.0, -3.0), DVec3::new(0.2, 0.0, -4.0)]);
        assert_eq!(dataset.points[1].colour, [4, 5, 6]);
        assert_eq!(dataset.notes.iter().filter(|note| note.contains("applied_transform")).count(), notes);
    }
}

#[test]
fn colmap_wins_and_a_json_can_be_named() {
    let scene = simple(2);
    let text = format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frame("images/00.png", ""));
    let path = scene.write("transforms.json", text);
    assert_eq!(open(&scene).expect("a scene").all().len(), 2);
    assert_eq!(scenes::open(&path, &LoadOptions::default()).expect("a scene").all().len(), 1);
}

#[test]
fn lenses_have_the_names_of_nerfstudio_and_instant_ngp() {
    let views = |more: &str| {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.write("transforms.json", format!(r#"{{{more} "frames": [{}]}}"#, frame("images/a.png", "")));
        open(&scene).expect("a scene").train
    };
    // The edges are 6 px from the centre, at 10 px per radian.
    let half = 6.0 / 10.0;
    for text in [r#""camera_model": "OPENCV_FISHEYE","#, r#""is_fisheye": true,"#, r#""camera_model": "FISHEYE","#] {
        let all = views(&format!(r#""fl_x": 10, {text}"#));
        let camera = &all[0].camera;
        let width = 2.0 * 10.0 * f64::tan(half);
        assert!((camera.fx - 10.0).abs() < 1e-6 && f64::from(camera.width) == width.round(), "{camera:?}");
    }
    let faces = views(r#""camera_model": "EQUIRECTANGULAR", "fl_x": 3, "cx": 1,"#);
    let names = names(&faces);
    assert_eq!(names, ["a.back.png", "a.down.png", "a.front.png", "a.left.png", "a.right.png", "a.up.png"]);
    assert!(faces.iter().all(|view| view.camera.width == view.camera.height));
    // Each coefficient bends the view.
    let width = |more: &str| views(&format!(r#""fl_x": 10, {more}"#))[0].camera.width;
    let listed = r#""camera_model": "OPENCV_FISHEYE", "distortion_params": [0.5, 0, 0, 0, 0, 0],"#;
    let named = r#""camera_model": "OPENCV_FISHEYE", "k1": 0.5,"#;
    assert!(width(listed) == width(named) && width(named) != width(r#""camera_model": "OPENCV_FISHEYE","#));
    let thin = r#""camera_model": "THIN_PRISM_FISHEYE","#;
    for name in ["sx1", "sy1"] {
        let shifted = views(&format!(r#""fl_x": 10, {thin} "{name}": 0.5,"#))[0].camera.clone();
        assert!(shifted != views(&format!(r#""fl_x": 10, {thin}"#))[0].camera, "{name}: {shifted:?}");
    }
}

#[test]
fn invalid_values_are_refused_with_their_place() {
    let broken = |text: String| {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.write("transforms.json", text);
        refusal(open(&scene))
    };
    let one = |more: &str, matrix: &str| {
        let text = format!(r#"{{"file_path": "images/a.png", "transform_matrix": {matrix}}}"#);
        broken(format!(r#"{{{more} "frames": [{text}]}}"#))
    };
    assert!(one("", IDENTITY_MATRIX).contains("camera_angle_x"));
    assert!(one(r#""fl_x": -1,"#, IDENTITY_MATRIX).contains("frame 0"));
    assert!(one(r#""camera_angle_x": 3.2,"#, IDENTITY_MATRIX).contains("focal"));
    assert!(one(r#""fl_x": 9, "camera_model": "ORTHOPHOTO","#, IDENTITY_MATRIX).contains("ORTHOPHOTO"));
    assert!(one(r#""fl_x": 9, "w": 11.5, "h": 8,"#, IDENTITY_MATRIX).contains("11.5"));
    assert!(one(r#""fl_x": 9,"#, "[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]").contains("rotation"));
    assert!(one(r#""fl_x": 9,"#, "[[1,0,0,0],[0,1,0,0]]").contains("4 x 4"));
    assert!(one(r#""fl_x": 9,"#, "[[1,1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").contains("rotation"));
    assert!(one(r#""fl_x": 9,"#, "[[1,0,0,1e999],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").contains("line 1"));
    for name in ["../a.png", "/etc/passwd", "images/../../a.png"] {
        let text = broken(format!(r#"{{"fl_x": 9, "frames": [{}]}}"#, frame(name, "")));
        assert!(text.contains("outside the scene"), "{text}");
    }
    assert!(broken(r#"{"frames": []}"#.into()).contains("lists no photo"));
    assert!(broken("[".repeat(100_000)).contains("line 1"));
    assert!(broken(r#"{"frames": [{"file_path": "a"}]}"#.into()).contains("transform_matrix"));
    let without = broken(r#"{"fl_x": 9}"#.into());
    assert!(without.contains("missing field \"frames\"; expected an object"), "{without}");
    assert!(
        one(r#""fl_x": 9, "is_fisheye": true, "camera_model": "OPENCV","#, IDENTITY_MATRIX)
            .contains("is_fisheye is true")
    );
    assert!(one(r#""fl_x": 9, "distortion_params": [0.1],"#, IDENTITY_MATRIX).contains("1 numbers"));
}

/// One unusable frame of many only costs its photo; a problem of all frames is an error.
#[test]
fn a_broken_frame_leaves_its_photo_out() {
    let open = |broken: &str| {
        let scene = Scene::new();
        (0..12).for_each(|index| scene.photo(&format!("images/{index}.png"), 12, 8));
        let mut frames: Vec<String> = (0..12).map(|index| frame(&format!("images/{index}.png"), "")).collect();
        frames[3] = broken.to_owned();
        scene.write("transforms.json", format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frames.join(",")));
        super::open(&scene).expect("a scene")
    };
    let nan = frame("images/3.png", "").replace("[0,0,1,0]", "[0,0,NaN,-Infinity]");
    let zero = frame("images/3.png", "").replace("[0,0,1,0]", "[0,0,0,0]");
    let without = r#"{"file_path": "images/3.png"}"#;
    let text = r#"{"file_path": "images/3.png", "transform_matrix": "eye"}"#;
    for broken in [&nan, &zero, without, text, &frame("images/3.png", r#", "fl_x": -3"#)] {
        let dataset = open(broken);
        assert_eq!(dataset.train.len(), 11, "{broken}");
        let names = |note: &&String| note.contains("1 of 12") && note.contains("frame 3 (`images/3.png`)");
        assert!(dataset.notes.iter().any(|note| names(&note)), "{:?}", dataset.notes);
        assert_eq!(dataset.flaws.len(), 1);
    }
}

#[test]
fn keys_of_other_programs_are_used_or_named() {
    let open = |more: &str, frame: &str| {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.write("transforms.json", format!(r#"{{{more} "frames": [{frame}]}}"#));
        open(&scene).expect("a scene")
    };
    let a = |more: &str| frame("images/a.png", more);
    let camera = |dataset: Dataset| dataset.train[0].camera.clone();
    // An angle of the frame against a length of the file.
    let own = camera(open(r#""fl_x": 100, "fl_y": 100,"#, &a(r#", "camera_angle_x": 1.0"#)));
    assert!((own.fx - 6.0 / 0.5f64.tan()).abs() < 1e-12 && own.fx == own.fy, "{own:?}");
    // Columns instead of rows.
    let usual = r#"[[0,0,1,5],[1,0,0,6],[0,1,0,7],[0,0,0,1]]"#;
    let turned = r#"[[0,1,0,0],[0,0,1,0],[1,0,0,0],[5,6,7,1]]"#;
    let of = |matrix: &str| open(r#""fl_x": 10,"#, &a("").replace(IDENTITY_MATRIX, matrix));
    let transposed = of(turned);
    noted(&transposed.notes, &["transposed"]);
    assert_eq!(camera(transposed), camera(of(usual)));
    // Mitsuba's cameras look along z, with x to the left.
    let mitsuba = camera(open(r#""fl_x": 10, "from_mitsuba": true,"#, &a("")));
    assert!(mitsuba.to_camera(DVec3::new(1.0, 2.0, 3.0)).distance(DVec3::new(-1.0, -2.0, 3.0)) < 1e-12);
    // OpenCV's full model, by its name or by coefficients that only it has.
    let wide = |more: &str| {
        open(&format!(r#""fl_x": 10, "k1": 0.2, {more}"#), &a("")).train[0].photo().expect("one").rgba.clone()
    };
    let full = wide(r#""camera_model": "FULL_OPENCV", "k4": 0.5, "k6": 0.1,"#);
    assert!(full == wide(r#""k4": 0.5, "k6": 0.1,"#) && full != wide(r#""k4": 0.5,"#));
    assert_eq!(open(r#""latlong": true,"#, &a("")).train.len(), 6);
    for (key, value) in [("rolling_shutter", "[0, 0, 0, 0.1]"), ("white_transparent", "true"), ("time", "0.5")] {
        let notes = open(&format!(r#""fl_x": 10, "{key}": {value},"#), &a("")).notes;
        noted(&notes, &[&format!("\"{key}\"")]);
    }
    let quiet =
        open(r#""fl_x": 10, "rolling_shutter": [0, 0, 0], "white_transparent": false, "aabb_scale": 4,"#, &a(""));
    assert!(quiet.notes.iter().all(|note| !note.contains("is not used")), "{:?}", quiet.notes);
}

#[test]
fn intrinsics_that_are_shares_of_the_photo_are_named() {
    let scene = Scene::new();
    scene.photo("images/a.png", 1200, 800);
    let text =
        format!(r#"{{"fl_x": 0.9, "fl_y": 1.2, "cx": 0.5, "cy": 0.5, "frames": [{}]}}"#, frame("images/a.png", ""));
    scene.write("transforms.json", text);
    let text = refusal(open(&scene));
    assert!(text.contains("share of the photo's size"), "{text}");
}

#[test]
fn points_that_no_key_names_are_used_and_named() {
    let scene = Scene::new();
    scene.photo("images/a.png", 12, 8);
    scene.write("transforms.json", format!(r#"{{"fl_x": 10, "frames": [{}]}}"#, frame("images/a.png", "")));
    let points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                  property ushort diffuse_red\nproperty ushort diffuse_green\nproperty ushort diffuse_blue\nend_header\n\
                  1 2 3 65535 257 0\n";
    scene.write("sparse_pc.ply", points);
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.points[0].colour, [255, 1, 0]);
    noted(&dataset.notes, &["sparse_pc.ply"]);
}
