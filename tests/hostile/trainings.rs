//! Unusual but valid scenes train to a finite model.

use crate::support::device;
use assert_cmd::Command;
use labelgs::run::TrainConfig;
use labelgs::scene::{Camera, Dataset, LabelMap, Photo, View};
use labelgs::scenes::initial_gaussians;
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{Preset, SynthOptions, dataset};
use labelgs::train::Trainer;
use std::path::Path;

/// Four views of 40 x 30 px with masks.
fn scene() -> Dataset {
    dataset(
        &SynthOptions {
            preset: Preset::Simple,
            width: 40,
            height: 30,
            views: 4,
            points: 200,
            seed: 5,
            ..SynthOptions::default()
        },
        0,
    )
}

/// Trains a dozen steps with labels, densification and votes; losses and model are numbers.
#[track_caller]
fn trains(name: &str, scene: Dataset) {
    let Some(turn) = device() else { return };
    let config = TrainConfig {
        iterations: 12,
        label_from: Some(3),
        occlusion_every: Some(4),
        vote_every: Some(4),
        densify_from: Some(2),
        densify_interval: Some(4),
        sh_degree_interval: Some(3),
        ..TrainConfig::default()
    };
    let start = initial_gaussians(&scene, 1, 150).unwrap_or_else(|error| panic!("{name}: {error}"));
    let options = SchedulerOptions::default();
    let mut trainer = Trainer::new(turn.gpu(), config.clone(), &scene, &start, options).expect(name);
    let mut reports = Vec::new();
    for _ in 0..config.iterations {
        reports.extend(trainer.step().unwrap_or_else(|error| panic!("{name}: {error}")));
    }
    reports.extend(trainer.drain().unwrap_or_else(|error| panic!("{name}: {error}")));
    assert_eq!(reports.len(), 12, "{name}");
    assert!(reports.iter().all(|report| report.loss.is_finite() && report.label_loss.is_finite()), "{name}");
    let model = trainer.labelled_model().expect(name);
    assert!(!model.is_empty(), "{name}: nothing is left");
    let values = model.means.iter().chain(&model.scales).chain(&model.sh0).flatten().chain(&model.opacities);
    assert!(values.into_iter().all(|value| value.is_finite()), "{name}: the model is not finite");
}

#[test]
fn one_view_trains() {
    let mut scene = scene();
    scene.train.truncate(1);
    scene.test.clear();
    trains("one view", scene.clone());
    scene.points.clear();
    trains("one view, no points", scene);
}

#[test]
fn views_of_one_pose_train() {
    let mut scene = scene();
    let camera = scene.train[0].camera.clone();
    scene.train.iter_mut().for_each(|view| view.camera = camera.clone());
    trains("one pose", scene.clone());
    scene.points.clear();
    trains("one pose, no points", scene.clone());
    // Apart by rounding, like poses from a program.
    for (index, view) in scene.train.iter_mut().enumerate() {
        view.camera.translation.x += 1e-17 * index as f64;
    }
    trains("one pose but for rounding", scene);
}

#[test]
fn cameras_at_one_place_that_turn_train() {
    let mut scene = scene();
    let centre = scene.train[0].camera.centre();
    scene.train.iter_mut().for_each(|view| view.camera.translation = -(view.camera.rotation * centre));
    scene.points.clear();
    trains("a panorama", scene);
}

#[test]
fn a_scene_without_points_trains() {
    let mut scene = scene();
    scene.points.truncate(3);
    trains("three points", scene.clone());
    scene.points.clear();
    scene.train.iter_mut().for_each(|view| view.mask = None);
    trains("no points and no masks", scene);
}

#[test]
fn points_mostly_behind_the_cameras_train() {
    let mut scene = scene();
    let far = scene.extent() * 100.0;
    scene.points.iter_mut().skip(20).for_each(|point| point.position.y += far);
    trains("points elsewhere", scene);
}

/// Half of the points within arm's reach of the cameras, some at their very centres.
#[test]
fn cameras_inside_the_cloud_train() {
    let mut scene = scene();
    let centres: Vec<_> = scene.train.iter().map(|view| view.camera.centre()).collect();
    for (index, point) in scene.points.iter_mut().enumerate().filter(|(index, _)| index % 2 == 0) {
        let part = |step: usize| (index * step % 17) as f64 / 17.0 - 0.5;
        let reach = if index % 10 == 0 { 0.0 } else { 0.6 };
        point.position = centres[index / 2 % centres.len()] + reach * glam::DVec3::new(part(3), part(5), part(7));
    }
    trains("cameras inside the cloud", scene);
}

#[test]
fn masks_of_every_kind_train() {
    let with = |change: &dyn Fn(usize, &mut LabelMap)| {
        let mut scene = scene();
        let masks = scene.train.iter_mut().enumerate();
        masks.for_each(|(index, view)| {
            let mask = view.mask.as_mut().expect("a mask");
            mask.edit(|mask| change(index, mask)).expect("in memory");
        });
        scene
    };
    trains(
        "an id in one view",
        with(&|index, mask| mask.ids.iter_mut().for_each(|id| *id = if index == 0 { *id } else { 0 })),
    );
    trains("far ids", with(&|_, mask| mask.ids.iter_mut().for_each(|id| *id = id.saturating_mul(9000))));
    trains("background only", with(&|_, mask| mask.ids.fill(0)));
    trains("one label everywhere", with(&|_, mask| mask.ids.fill(65_535)));
    let mut some = scene();
    some.train.iter_mut().skip(1).for_each(|view| view.mask = None);
    trains("a mask for one view", some);
}

/// Views of this size before a few points.
fn tiny(width: u32, height: u32) -> Dataset {
    let mut scene = scene();
    for view in &mut scene.train {
        let (old, camera) = (view.camera.clone(), view.camera.resized(width, height));
        // Square pixels, the principal point unchanged.
        let focal = camera.fx.min(camera.fy);
        let camera = Camera { fx: focal, fy: focal, ..camera };
        let pixels = (width * height) as usize;
        let photo = Photo { width, height, rgba: vec![[90, 120, 30, 255]; pixels] };
        let mask = LabelMap { width, height, ids: (0..pixels).map(|pixel| (pixel % 3) as u16).collect() };
        assert!(camera.cx > 0.0 && old.width > width);
        *view = View { name: view.name.clone(), camera, photo: Some(photo.into()), mask: Some(mask.into()) };
    }
    scene
}

#[test]
fn pictures_of_a_pixel_and_of_a_line_train() {
    for (width, height) in [(1, 1), (1, 17), (17, 1), (3, 2)] {
        trains(&format!("{width} x {height} px"), tiny(width, height));
    }
}

fn labelgs(args: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let output = command.env("LABELGS_VALIDATION", "off").args(args).output().expect("it runs");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// The flags as a user types them, on a scene with a damaged photo, a photo elsewhere and masks of half the size.
#[test]
fn a_damaged_scene_trains_with_warnings_or_says_what_is_wrong() {
    let Some(_turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let scene = at("scene");
    let made = ["synth", &scene, "--preset", "simple", "--size", "48x36", "--views", "10", "--points", "300"];
    assert_eq!(labelgs(&made).0, Some(0));
    let photos = |scene: &str| {
        let entries = std::fs::read_dir(Path::new(scene).join("images")).expect("photos");
        let mut found: Vec<_> = entries.map(|entry| entry.expect("a photo").path()).collect();
        found.sort();
        found
    };
    let damaged = photos(&scene)[3].clone();
    std::fs::write(&damaged, b"no picture").expect("written");
    for mask in
        std::fs::read_dir(Path::new(&scene).join("masks")).expect("masks").map(|entry| entry.expect("a mask").path())
    {
        if mask.extension().is_some_and(|extension| extension == "png") {
            let whole = labelgs::masks::read_mask(&mask).expect("a mask");
            let ids: Vec<u16> = (0..24 * 18).map(|index| whole.at(index % 24 * 2, index / 24 * 2)).collect();
            labelgs::files::image::write_png_grey16(&mask, 24, 18, &ids).expect("a mask");
        }
    }
    let (masks, out) = (at("scene/masks"), at("out"));
    let train = |more: &[&str]| labelgs(&[&["train", &scene, "-o", &out, "--iterations", "3"], more].concat());
    let (status, text) = train(&["--masks", &masks]);
    assert_eq!(status, Some(0), "{text}");
    let name = damaged.file_name().expect("a name").to_string_lossy().into_owned();
    assert!(text.contains("1 of 10 photos cannot be read") && text.contains(&name), "{text}");
    assert!(text.contains("of another size than their photos"), "{text}");
    let (status, text) = train(&["--max-bad-photos", "0"]);
    assert_eq!(status, Some(3), "{text}");
    assert!(text.contains("--max-bad-photos 0 allows 0") && text.contains(&name), "{text}");
    assert_eq!(train(&["--max-bad-photos", "2"]).0, Some(2));
    // All poses turned round: no camera sees a point any more.
    let images = Path::new(&scene).join("sparse/0/images.bin");
    let bytes = std::fs::read(&images).expect("poses");
    std::fs::write(&images, turned(&bytes)).expect("written");
    let (status, text) = train(&[]);
    assert_eq!(status, Some(3), "{text}");
    assert!(text.contains("points: none of the"), "{text}");
}

/// `images.bin` with every camera turned by half a turn about its vertical axis.
fn turned(bytes: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let mut at = 8;
    while at < bytes.len() {
        let f64_at = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
        let [w, x, y, z] = [0, 1, 2, 3].map(|part| f64_at(at + 4 + 8 * part));
        // (0, 0, 1, 0) times the rotation; the translation turns with it.
        let rotation = [-y, z, w, -x];
        let translation = [-f64_at(at + 36), f64_at(at + 44), -f64_at(at + 52)];
        for (part, value) in rotation.iter().chain(&translation).enumerate() {
            out[at + 4 + 8 * part..at + 12 + 8 * part].copy_from_slice(&value.to_le_bytes());
        }
        at += 64;
        at += bytes[at..].iter().position(|&byte| byte == 0).expect("a name") + 1;
        let observations = u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
        at += 8 + 24 * observations as usize;
    }
    out
}
