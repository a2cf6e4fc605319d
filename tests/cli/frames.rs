//! The video through the photos and the way back: order, cameras between, frames and their masks.

use assert_cmd::Command;
use glam::{DMat3, DQuat, DVec3};
use labelgs::masks::read_mask;
use labelgs::scene::Camera;
use labelgs::scene::path::{Interpolation, interpolate, short_order, video};
use labelgs::scenes::{Frame, Frames, LoadOptions};
use labelgs::synth::SynthOptions;
use labelgs::synth::ring_of_cameras;
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn camera(rotation: DQuat, centre: [f64; 3]) -> Camera {
    let rotation = DMat3::from_quat(rotation);
    let translation = -(rotation * DVec3::from_array(centre));
    Camera { rotation, translation, fx: 90.0, fy: 91.0, cx: 32.0, cy: 24.0, width: 64, height: 48 }
}

fn labelgs(args: &[&str]) -> Output {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("LABELGS_VALIDATION", "off").args(args).output().expect("it runs")
}

#[track_caller]
fn succeeds(args: &[&str]) -> String {
    let output = labelgs(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[track_caller]
fn fails(status: i32, part: &str, args: &[&str]) {
    let output = labelgs(args);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(status) && text.contains(part), "{:?} {text}", output.status.code());
}

/// method.md check 9.
#[test]
fn a_video_has_its_frames_and_photos_are_every_tenth() {
    let cameras = ring_of_cameras(&SynthOptions { views: 6, ..SynthOptions::default() });
    let all: Vec<&Camera> = cameras.iter().collect();
    for (count, between) in [(6, 9), (6, 0), (2, 3), (1, 9)] {
        let frames = video(&all[..count], between, Interpolation::Centres);
        assert_eq!(frames.len(), (between as usize + 1) * (count - 1) + 1);
        for (index, frame) in frames.iter().enumerate() {
            let step = between as usize + 1;
            let expected = index.is_multiple_of(step).then_some(index / step);
            assert_eq!(frame.camera_index, expected);
            if let Some(index) = expected {
                assert_eq!(frame.camera, cameras[index], "the camera of a photo is untouched");
            }
        }
    }
    assert!(video(&[], 9, Interpolation::Centres).is_empty());
}

#[test]
fn cameras_between_are_rotations_on_the_way() {
    let turn = |angle: f64| DQuat::from_axis_angle(DVec3::new(0.3, 0.9, -0.2).normalize(), angle);
    let start = camera(turn(0.4), [1.0, 2.0, 3.0]);
    // Equal, the same written with the other sign, almost equal, far, and half a turn.
    for (end, angle) in [
        (turn(0.4), 0.0),
        (-turn(0.4), 0.0),
        (turn(0.4 + 1e-9), 1e-9),
        (turn(1.9), 1.5),
        (-turn(1.9), 1.5),
        (turn(0.4 + std::f64::consts::PI), std::f64::consts::PI),
    ] {
        let end = Camera { fx: 100.0, cx: 30.0, ..camera(end, [-4.0, 0.5, 8.0]) };
        for step in 0..=10 {
            let t = f64::from(step) / 10.0;
            for how in [Interpolation::Centres, Interpolation::Translations] {
                let at = interpolate(&start, &end, t, how);
                assert!(at.rotation.is_finite() && at.translation.is_finite(), "{angle} {t}");
                let gram = at.rotation.transpose() * at.rotation - DMat3::IDENTITY;
                assert!(gram.to_cols_array().iter().all(|value| value.abs() < 1e-12), "{angle} {t}: no rotation");
                // Of a rotation the trace is 1 + 2 cos, whose arc cosine loses half of the digits at 0.
                let turned = start.rotation.transpose() * at.rotation;
                let trace = turned.x_axis.x + turned.y_axis.y + turned.z_axis.z;
                let found = ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
                assert!((found - t * angle).abs() < 1e-6, "{found} at {t} of {angle}");
            }
            let (line, code) = (
                interpolate(&start, &end, t, Interpolation::Centres),
                interpolate(&start, &end, t, Interpolation::Translations),
            );
            let expected = start.centre().lerp(end.centre(), t);
            assert!(line.centre().distance(expected) < 1e-12, "the centre leaves the segment");
            assert!((line.fx - (90.0 + 10.0 * t)).abs() < 1e-12 && (line.cx - (32.0 - 2.0 * t)).abs() < 1e-12);
            assert!(code.translation.distance(start.translation.lerp(end.translation, t)) < 1e-12);
            assert_eq!((code.fx, code.cx), (start.fx, start.cx));
        }
    }
    let far = camera(turn(1.9), [-4.0, 0.5, 8.0]);
    let off = interpolate(&start, &far, 0.5, Interpolation::Translations).centre();
    assert!(off.distance(start.centre().lerp(far.centre(), 0.5)) > 0.1, "the paper's way swings off the line");
}

fn length(cameras: &[&Camera], order: &[usize]) -> f64 {
    order.windows(2).map(|pair| cameras[pair[0]].centre().distance(cameras[pair[1]].centre())).sum()
}

#[test]
fn the_order_is_a_short_path() {
    // Along a line, shuffled: the only shortest path is the line.
    let places = [5.0, 1.0, 7.0, 3.0, 0.0, 6.0, 2.0, 4.0];
    let line: Vec<Camera> = places.iter().map(|&x| camera(DQuat::IDENTITY, [x, 0.0, 0.0])).collect();
    let line: Vec<&Camera> = line.iter().collect();
    let order = short_order(&line);
    let visited: Vec<f64> = order.iter().map(|&index| places[index]).collect();
    assert_eq!(visited, [7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0], "index 2 comes before index 4");
    assert_eq!(short_order(&line), order, "the same twice");
    // Cameras at one place, which differ in direction only.
    let angles = [0.9, 0.1, 0.5, 0.3, 0.7];
    let turned: Vec<Camera> = angles.iter().map(|&a| camera(DQuat::from_rotation_y(a), [1.0; 3])).collect();
    assert_eq!(short_order(&turned.iter().collect::<Vec<_>>()), [0, 4, 2, 3, 1]);
    // A ring with heights that jump by name: the path is no longer than by name and visits every camera once.
    let ring = ring_of_cameras(&SynthOptions { views: 60, ..SynthOptions::default() });
    let ring: Vec<&Camera> = ring.iter().collect();
    let order = short_order(&ring);
    let mut sorted = order.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, (0..60).collect::<Vec<_>>());
    let by_name: Vec<usize> = (0..60).collect();
    assert!(length(&ring, &order) < 0.8 * length(&ring, &by_name));
    assert_eq!(short_order(&[]), [0; 0]);
    assert_eq!(short_order(&ring[..1]), [0]);
}

/// Three photos, one in a folder. The tracked masks of the second and the last have other sizes.
fn tracked(folder: &Path) -> (String, String, String) {
    let path = |name: &str| folder.join(name).to_str().expect("UTF-8").to_owned();
    let at = camera(DQuat::IDENTITY, [0.0; 3]);
    let frame = |index: usize| Frame {
        file: format!("frames/{index:05}.png"),
        photo: [Some("b.jpg"), None, Some("left/a.png"), None, Some("c.d.jpg")][index].map(str::to_owned),
        size: None,
        camera: (&at).into(),
    };
    Frames::new((0..5).map(frame).collect(), false).write(Path::new(&path("video/frames.json"))).expect("written");
    for index in 0..5_u16 {
        let ids: Vec<u16> = (0..64 * 48).map(|i| if i % 64 < 30 { 300 * index + 1 } else { 0 }).collect();
        let file = folder.join(format!("tracked/{index:05}.png"));
        labelgs::files::image::write_png_grey16(&file, 64, 48, &ids).expect("written");
    }
    (path("tracked"), path("video/frames.json"), path("masks"))
}

#[test]
fn masks_go_back_to_their_photos() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, frames, masks) = tracked(folder.path());
    let args = ["masks", "collect", &source, "--frames", &frames, "-o", &masks, "--json"];
    let found: Value = serde_json::from_str(&succeeds(&args)).expect("JSON");
    assert_eq!((&found["schema_version"], found["masks"].as_array().map(Vec::len)), (&1.into(), Some(3)));
    for (photo, frame) in [("b.png", 0), ("left/a.png", 2), ("c.d.png", 4)] {
        let there = read_mask(Path::new(&source).join(format!("{frame:05}.png"))).expect("tracked");
        assert_eq!(read_mask(Path::new(&masks).join(photo)).expect("collected"), there, "{photo}");
    }
    let file = |name: &str| folder.path().join("tracked").join(name);
    labelgs::files::image::write_png_grey16(file("00002.png"), 48, 48, &[1; 48 * 48]).expect("written");
    fails(3, "48 x 48 px and its frame 64 x 48", &args);
    labelgs::files::image::write_png_rgb8(file("00002.png"), 64, 48, &[[1, 2, 3]; 64 * 48]).expect("written");
    fails(3, "one id per pixel", &args);
    std::fs::remove_file(file("00002.png")).expect("removed");
    fails(3, "1 of 3 photos have no tracked mask", &args);
    std::fs::remove_dir_all(file("")).expect("removed");
    fails(3, "does not exist", &args);
    let refused = |text: &str, part: &str| {
        std::fs::write(&frames, text).expect("written");
        std::fs::create_dir_all(&source).expect("a folder");
        fails(3, part, &args);
    };
    refused("{}", "expected {");
    refused(r#"{"schema_version": 1, "frames": []}"#, "no frame has the pose of a photo");
    refused(r#"{"schema_version": 7, "frames": []}"#, "version 7");
}

/// A quickly trained model and its scene: 12 views of 96 x 72 px.
fn model(folder: &Path) -> (String, String) {
    let path = |name: &str| folder.join(name).to_str().expect("UTF-8").to_owned();
    let (scene, out) = (path("scene"), path("out"));
    succeeds(&["synth", &scene, "--preset", "simple", "--size", "96x72", "--views", "12", "--points", "400"]);
    succeeds(&["train", &scene, "-o", &out, "--iterations", "30", "--test-every", "0"]);
    (scene, out)
}

#[test]
fn masks_of_a_rendered_video_return_to_their_photos() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, out) = model(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (there, video) = (path("pictures"), path("video"));
    let json = |text: String| serde_json::from_str::<Value>(&text).expect("JSON");
    let made = json(succeeds(&["frames", &out, "--scene", &scene, "-o", &video, "--between", "2", "--json"]));
    // Views 000 and 008 are held out.
    assert_eq!((&made["photos"], &made["frames"]), (&10.into(), &28.into()));
    succeeds(&["render", &out, "--scene", &scene, "--views", "train", "-o", &there]);
    let frames = Frames::read(&Path::new(&video).join("frames.json")).expect("frames");
    let mut photos = Vec::new();
    for (index, frame) in frames.frames.iter().enumerate() {
        let bytes = std::fs::read(Path::new(&video).join(&frame.file)).expect("a frame");
        let tracked = Path::new(&video).join("tracked").join(Path::new(&frame.file).file_name().expect("a name"));
        std::fs::create_dir_all(tracked.parent().expect("a folder")).expect("made");
        // Perfect tracking: ground truth for the photos, other ids between them.
        let Some(photo) = &frame.photo else {
            labelgs::files::image::write_png_grey16(tracked, 96, 72, &[9; 96 * 72]).expect("written");
            continue;
        };
        assert_eq!(index % 3, 0);
        photos.push(photo.clone());
        let rendered = Path::new(&there).join(photo.replace(".png", ".rgb.png"));
        assert!(bytes == std::fs::read(rendered).expect("a picture"), "{photo} differs from what render gives");
        std::fs::copy(Path::new(&scene).join("masks").join(photo), tracked).expect("copied");
    }
    assert_eq!(photos.len(), 10);
    assert!(!photos.iter().any(|photo| photo == "000.png" || photo == "008.png"), "{photos:?}");
    let (tracked, masks) = (format!("{video}/tracked"), path("masks"));
    succeeds(&["masks", "collect", &tracked, "--frames", &format!("{video}/frames.json"), "-o", &masks]);
    for photo in &photos {
        let truth = read_mask(Path::new(&scene).join("masks").join(photo)).expect("truth");
        assert_eq!(read_mask(Path::new(&masks).join(photo)).expect("a mask"), truth, "{photo}");
    }
    let camera = path("camera.json");
    std::fs::write(&camera, serde_json::to_string(&frames.frames[1].camera).expect("JSON")).expect("written");
    succeeds(&["render", &out, "--camera", &camera, "-o", &there]);
    let all = ["frames", &out, "--scene", &scene, "-o", &path("all"), "--between", "0", "--compat", "--include-test"];
    assert!(succeeds(&all).contains("12 frames through 12 photos"));
    let named = Frames::read(&Path::new(&path("all")).join("frames.json")).expect("frames");
    let names: Vec<&str> = named.frames.iter().filter_map(|frame| frame.photo.as_deref()).collect();
    assert!(names.len() == 12 && names.is_sorted(), "{names:?}");
}

/// The faces of a fisheye photo have sizes of their own; a frame has that of the largest.
#[test]
fn masks_of_faces_become_those_of_their_photos() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (scene, out, video, masks) = (path("scene"), path("out"), path("video"), path("masks"));
    let lens = ["--lens", "OPENCV_FISHEYE", "--fov", "150", "--size", "160x120", "--views", "2"];
    succeeds(&[&["synth", &scene, "--preset", "simple"], &lens[..]].concat());
    succeeds(&["train", &scene, "-o", &out, "--iterations", "2", "--test-every", "0"]);
    let densify = ["frames", &out, "--scene", &scene, "-o", &video, "--between", "0", "--include-test"];
    succeeds(&densify);
    let load = LoadOptions { masks: Some(format!("{scene}/masks").into()), ..LoadOptions::default() };
    let dataset = labelgs::scenes::open(Path::new(&scene), &load).expect("read");
    let frames = Frames::read(&Path::new(&video).join("frames.json")).expect("frames");
    assert!(frames.lenses && frames.frames.len() > 6 && frames.frames.iter().any(|frame| frame.size.is_some()));
    let tracked = path("tracked");
    for frame in &frames.frames {
        let view = dataset.all().into_iter().find(|view| Some(&view.name) == frame.photo.as_ref()).expect("a face");
        let ids = view.mask().expect("read").expect("a mask");
        let (width, height) = (frame.camera.width, frame.camera.height);
        assert_eq!(frame.size.unwrap_or([width, height]), [ids.width, ids.height]);
        // What lies beside the face is not of its photo.
        let padded: Vec<u16> = (0..width * height).map(|at| ids.get(at % width, at / width).unwrap_or(77)).collect();
        let file = Path::new(&tracked).join(Path::new(&frame.file).file_name().expect("a name"));
        labelgs::files::image::write_png_grey16(file, width, height, &padded).expect("written");
    }
    let collect = ["masks", "collect", &tracked, "--frames", &format!("{video}/frames.json"), "-o", &masks];
    fails(2, "is needed: the photos of this video", &collect);
    succeeds(&[&collect[..], &["--scene", &scene]].concat());
    for photo in ["000.png", "001.png"] {
        let truth = read_mask(Path::new(&scene).join("masks").join(photo)).expect("truth");
        let found = read_mask(Path::new(&masks).join(photo)).expect("a mask");
        let same = truth.ids.iter().zip(&found.ids).filter(|(a, b)| a == b).count();
        assert_eq!((found.width, found.height), (160, 120));
        assert!(truth.objects() == found.objects() && same > 160 * 120 * 98 / 100, "{photo}: {same}");
    }
}

#[test]
fn occluders_go_from_the_verb_into_a_run() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, out) = model(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let json =
        |file: &str| -> Value { serde_json::from_str(&std::fs::read_to_string(file).expect("written")).expect("JSON") };
    let (masks, depths, pictures) = (format!("{scene}/masks"), format!("{scene}/depth"), path("pictures"));
    let (by_depth, by_model) = (path("depth.json"), path("model.json"));
    let verb = ["occlusion", &scene, "--masks", &masks];
    let with_depth = [&verb[..], &["--depths", &depths, "--depth-kind", "metric", "-o", &by_depth]].concat();
    succeeds(&[&with_depth[..], &["--pictures", &pictures]].concat());
    succeeds(&[&verb[..], &["--model", &out, "-o", &by_model]].concat());
    assert!(Path::new(&pictures).join("011.png").is_file());
    let (depth, model) = (json(&by_depth), json(&by_model));
    assert_eq!((&depth["kind"], &model["kind"]), (&"depth".into(), &"rendered".into()));
    assert_eq!(depth["views"].as_object().map(serde_json::Map::len), Some(12));
    fails(2, "--depth-kind", &[&verb[..], &["--depths", &depths, "-o", &by_depth]].concat());

    let train = |name: &str, more: &[&str]| {
        let out = path(name);
        let base = [
            "train",
            &scene,
            "--masks",
            &masks,
            "--test-every",
            "0",
            "--iterations",
            "4",
            "--set",
            "label_from=2",
            "-o",
            &out,
        ];
        succeeds(&[&base[..], more].concat());
        json(&format!("{out}/occlusion.json"))
    };
    // The verb and training agree, and a written list comes back as it was.
    assert_eq!(train("b", &["--occluders", &by_depth]), depth);
    assert_eq!(train("c", &["--set", "occlusion=none"])["kind"], "none");
    assert_eq!(train("d", &[])["kind"], "rendered");
    let bare = ["train", &scene, "-o", &path("e"), "--masks", &masks];
    fails(2, "cannot be given with", &[&bare[..], &["--occluders", &by_depth, "--set", "occlusion=none"]].concat());
}
