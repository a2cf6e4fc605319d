//! COLMAP models: binary and text, intact and damaged.

use super::fixtures::*;
use super::{names, noted, open};
use glam::{DQuat, DVec3};
use labelgs_scene::Dataset;
use labelgs_scene::Error;
use labelgs_scenes::{self as scenes, LoadOptions};
use std::fs;

fn check_poses(dataset: &Dataset, names: &[&str]) {
    assert_eq!(dataset.train.len(), names.len());
    for (index, name) in names.iter().enumerate() {
        let view = dataset.train.iter().find(|view| view.name == *name).expect("the view");
        let ([w, x, y, z], translation) = pose(index);
        let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
        let point = DVec3::new(0.3, -0.7, 1.1);
        let expected = rotation * point + DVec3::from_array(translation);
        assert!(view.camera.to_camera(point).distance(expected) < 1e-12);
    }
    let points: Vec<_> = dataset.points.iter().map(|p| (p.position.to_array(), p.colour)).collect();
    assert_eq!(points, POINTS);
}

#[test]
fn binary_and_text_read_alike_in_every_folder() {
    let names = ["b 1.png", "sub/a.png", "c.png"];
    for folder in ["sparse/0", "sparse", "colmap/sparse/0", "."] {
        for binary in [true, false] {
            let scene = Scene::new();
            if binary {
                scene.colmap_bin(folder, &[pinhole()], &names);
            } else {
                scene.colmap_txt(folder, &[pinhole()], &names);
            }
            names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
            // Files of newer versions, which are ignored.
            for file in ["rigs.bin", "frames.bin", "rigs.txt", "frames.txt"] {
                std::fs::write(scene.path().join(folder).join(file), [0xff; 9]).expect("written");
            }
            let dataset = open(&scene).expect("a scene");
            check_poses(&dataset, &names);
            let sorted = super::names(&dataset.train);
            assert_eq!(sorted, ["b 1.png", "c.png", "sub/a.png"]);
            let camera = &dataset.train[0].camera;
            assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (10.0, 11.0, 5.5, 4.5));
            assert_eq!(dataset.train[2].stem(), "sub_a");
        }
    }
}

#[test]
fn binary_wins_over_text_and_photos_may_lie_in_the_root() {
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[pinhole()], &["a.png"]);
    scene.colmap_txt("sparse/0", &[pinhole()], &["other.png"]);
    scene.photo("a.png", 12, 8);
    assert_eq!(open(&scene).expect("a scene").train[0].name, "a.png");
}

#[test]
fn every_camera_model_has_its_parameters_in_its_order() {
    let models: [(u32, &str, &[f64]); 18] = [
        (0, "SIMPLE_PINHOLE", &[10.0, 6.0, 4.0]),
        (1, "PINHOLE", &[10.0, 11.0, 6.0, 4.0]),
        (2, "SIMPLE_RADIAL", &[10.0, 6.0, 4.0, 0.01]),
        (3, "RADIAL", &[10.0, 6.0, 4.0, 0.01, 0.001]),
        (4, "OPENCV", &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003]),
        (5, "OPENCV_FISHEYE", &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003]),
        (6, "FULL_OPENCV", &[10.0, 11.0, 6.0, 4.0, 0.01, 0.001, 0.002, 0.003, 0.004, 0.01, 0.0, 0.0]),
        (7, "FOV", &[10.0, 11.0, 6.0, 4.0, 0.5]),
        (8, "SIMPLE_RADIAL_FISHEYE", &[10.0, 6.0, 4.0, 0.01]),
        (9, "RADIAL_FISHEYE", &[10.0, 6.0, 4.0, 0.01, 0.001]),
        (10, "THIN_PRISM_FISHEYE", &[10.0, 11.0, 6.0, 4.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (11, "RAD_TAN_THIN_PRISM_FISHEYE", &[10.0, 11.0, 6.0, 4.0, 0.01, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0.]),
        (12, "SIMPLE_DIVISION", &[10.0, 6.0, 4.0, -0.01]),
        (13, "DIVISION", &[10.0, 11.0, 6.0, 4.0, -0.01]),
        (14, "SIMPLE_FISHEYE", &[10.0, 6.0, 4.0]),
        (15, "FISHEYE", &[10.0, 11.0, 6.0, 4.0]),
        (16, "EUCM", &[10.0, 11.0, 6.0, 4.0, 0.5, 1.1]),
        (17, "EQUIRECTANGULAR", &[12.0, 8.0]),
    ];
    for (model, name, parameters) in models {
        let camera = ColmapCamera { model, name, size: (12, 8), parameters: parameters.to_vec() };
        for binary in [true, false] {
            let scene = Scene::new();
            scene.photo("images/a.png", 12, 8);
            if binary {
                scene.colmap_bin("sparse/0", std::slice::from_ref(&camera), &["a.png"]);
            } else {
                scene.colmap_txt("sparse/0", std::slice::from_ref(&camera), &["a.png"]);
            }
            let dataset = open(&scene).expect("a scene");
            assert_eq!(dataset.train.len(), if model == 17 { 6 } else { 1 }, "{name}");
            assert_eq!(dataset.notes.iter().any(|note| note.contains("undistorted")), model > 1);
            // Polynomials keep the intrinsics; the others keep the scale at the centre.
            let read = &dataset.train[0].camera;
            if matches!(model, 0..=4 | 6) {
                assert_eq!((read.fx, read.cx, read.cy), (10.0, 6.0, 4.0));
            }
            if model < 17 {
                let fy = if parameters[1] == 11.0 { 11.0 } else { 10.0 };
                let middle = if model == 7 { 2.0 * 0.25_f64.tan() / 0.5 } else { 1.0 };
                assert!(
                    (read.fx - 10.0 * middle).abs() < 1e-3 && (read.fy - fy * middle).abs() < 1e-3,
                    "{name}: {read:?}"
                );
            }
        }
    }
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[ColmapCamera { model: 77, ..pinhole() }], &["a.png"]);
    assert!(refusal(open(&scene)).contains("77 is unknown"));
    for (model, name, parameters) in [
        (7, "FOV", vec![10.0, 11.0, 6.0, 4.0, 0.0]),
        (16, "EUCM", vec![10.0, 11.0, 6.0, 4.0, 1.5, 1.0]),
        (17, "EQUIRECTANGULAR", vec![24.0, 8.0]),
    ] {
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.colmap_bin("sparse/0", &[ColmapCamera { model, name, size: (12, 8), parameters }], &["a.png"]);
        let text = refusal(open(&scene));
        assert!(text.contains("camera 1") && text.contains("expected"), "{text}");
    }
}

#[test]
fn missing_photos_are_skipped_before_the_split() {
    let scene = simple(10);
    fs::remove_file(scene.path().join("images/00.png")).expect("removed");
    let dataset =
        scenes::open(scene.path(), &LoadOptions { test_every: Some(4), ..LoadOptions::default() }).expect("a scene");
    let test = names(&dataset.test);
    assert_eq!(test, ["01.png", "05.png", "09.png"]);
    assert_eq!(dataset.train.len(), 6);
    assert_eq!(dataset.notes.iter().filter(|note| note.contains("1 of 10")).count(), 1);
    (1..6).for_each(|index| fs::remove_file(scene.path().join(format!("images/0{index}.png"))).expect("removed"));
    assert!(refusal(open(&scene)).contains("6 of 10"));
}

#[test]
fn a_single_photo_is_trained_on() {
    let dataset = scenes::open(simple(1).path(), &LoadOptions::default()).expect("a scene");
    assert_eq!((dataset.train.len(), dataset.test.len()), (1, 0));
    let zero = LoadOptions { test_every: Some(0), ..LoadOptions::default() };
    assert!(matches!(scenes::open(simple(2).path(), &zero).expect_err("no split"), Error::Usage { .. }));
}

#[test]
fn without_photos_cameras_are_enough() {
    let scene = simple(3);
    let options = LoadOptions { photos: false, max_resolution: Some(6), ..LoadOptions::default() };
    let with_files = scenes::open(scene.path(), &options).expect("a scene");
    fs::remove_dir_all(scene.path().join("images")).expect("removed");
    let without = scenes::open(scene.path(), &options).expect("a scene");
    assert!(without.all().iter().all(|view| view.photo.is_none()));
    let cameras = |d: &Dataset| d.all().iter().map(|view| view.camera.clone()).collect::<Vec<_>>();
    assert_eq!(cameras(&with_files), cameras(&without));
    assert_eq!(without.train[0].camera.width, 6);
}

#[test]
fn damaged_binaries_are_refused_at_every_cut() {
    for file in ["cameras.bin", "images.bin", "points3D.bin"] {
        let scene = simple(2);
        let path = scene.path().join("sparse/0").join(file);
        let whole = fs::read(&path).expect("bytes");
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).expect("written");
            let text = refusal(open(&scene));
            assert!(text.contains(file) && text.contains("byte "), "{text}");
        }
        // A huge count must fail at the end of the file, not in an allocation.
        for count in [u64::MAX, u64::MAX / 2, 1 << 40] {
            let mut hostile = whole.clone();
            hostile[..8].copy_from_slice(&count.to_le_bytes());
            fs::write(&path, &hostile).expect("written");
            assert!(refusal(open(&scene)).contains(&count.to_string()));
        }
    }
}

#[test]
fn hostile_records_are_refused() {
    let scene = simple(1);
    let images = scene.path().join("sparse/0/images.bin");
    let points = scene.path().join("sparse/0/points3D.bin");
    let (good, good_points) = (fs::read(&images).expect("bytes"), fs::read(&points).expect("bytes"));
    let try_images = |bytes: Vec<u8>| {
        fs::write(&images, bytes).expect("written");
        refusal(open(&scene))
    };
    let name_at = 8 + 4 + 56 + 4;
    let patched = |at: usize, with: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        bytes
    };
    assert!(try_images(patched(name_at, &[0xff])).contains("UTF-8"));
    assert!(try_images(patched(name_at + 7, &(1u64 << 63).to_le_bytes())).contains("observations"));
    assert!(try_images(patched(8 + 4 + 56, &9u32.to_le_bytes())).contains("camera 9"));
    assert!(try_images(patched(12, &[0; 32])).contains("rotation"));
    assert!(try_images(patched(12 + 32, &f64::NAN.to_le_bytes())).contains("finite"));
    assert!(try_images(patched(name_at, b"../a.p")).contains("outside"));
    let mut unended = good[..name_at].to_vec();
    unended.extend([b'x'; 5000]);
    assert!(try_images(unended).contains("name does not end"));
    let mut twice = images_bin(&["00.png", "00.png"], 1);
    assert!(try_images(twice.clone()).contains("listed before"));
    twice[0] = 0;
    assert!(try_images(twice).contains("lists no photo"));
    fs::write(&images, &good).expect("written");
    let mut track = good_points.clone();
    track[8 + 8 + 24 + 3 + 8..][..8].copy_from_slice(&u64::MAX.to_le_bytes());
    fs::write(&points, track).expect("written");
    assert!(refusal(open(&scene)).contains("track"));
    let mut not_finite = good_points;
    not_finite[16..24].copy_from_slice(&f64::INFINITY.to_le_bytes());
    fs::write(&points, not_finite).expect("written");
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.points.len(), 1);
    noted(&dataset.notes, &["1 of 2 points"]);
    fs::remove_file(&points).expect("removed");
    assert!(open(&scene).expect("a scene without points").points.is_empty());
}

#[test]
fn degenerate_cameras_are_refused() {
    let with = |index: usize, value: f64| {
        let mut camera = pinhole();
        camera.parameters[index] = value;
        let scene = Scene::new();
        scene.photo("images/a.png", 12, 8);
        scene.colmap_bin("sparse/0", &[camera], &["a.png"]);
        refusal(open(&scene))
    };
    for value in [0.0, -3.0, f64::NAN, f64::INFINITY, 1e-9] {
        assert!(with(0, value).contains("camera 1"));
    }
    for value in [f64::NAN, -50.0, 50.0] {
        assert!(with(2, value).contains("principal point"));
    }
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[ColmapCamera { size: (u64::MAX, 8), ..pinhole() }], &["a.png"]);
    assert!(refusal(open(&scene)).contains("18446744073709551615"));
    let scene = Scene::new();
    let tiny = ColmapCamera { size: (1, 1), parameters: vec![10.0, 10.0, 0.5, 0.5], ..pinhole() };
    scene.colmap_bin("sparse/0", &[tiny], &["a.png"]);
    scene.photo("images/a.png", 1, 1);
    assert_eq!(open(&scene).expect("a scene").train[0].camera.width, 1);
}

#[test]
fn broken_text_names_the_line() {
    let broken = |file: &str, text: &str| {
        let scene = Scene::new();
        scene.colmap_txt("sparse", &[pinhole()], &["a.png"]);
        scene.photo("images/a.png", 12, 8);
        scene.write(&format!("sparse/{file}"), text);
        refusal(open(&scene))
    };
    assert!(broken("cameras.txt", "# c\n1 PINHOLE 12 8 10 11 5").contains("4 parameters, but 3"));
    assert!(broken("cameras.txt", "# c\n1 PINHOLE twelve 8").contains("line 2"));
    assert!(broken("cameras.txt", "1 MAGIC 12 8 1").contains("MAGIC"));
    assert!(broken("images.txt", "1 1 0 0 0 0 0 0 1\n\n").contains("name"));
    assert!(broken("images.txt", "1 1 0 0 x 0 0 0 1 a.png\n\n").contains("`x`"));
    assert!(broken("points3D.txt", "\n1 0 0 0 300 0 0").contains("line 2"));
}

#[test]
fn a_folder_without_scene_says_what_was_expected() {
    let scene = Scene::new();
    let text = refusal(open(&scene));
    assert!(text.contains("sparse/0") && text.contains("transforms.json"));
    assert!(refusal(scenes::open(&scene.path().join("nowhere"), &LoadOptions::default())).contains("no such folder"));
}

#[test]
fn poses_without_second_lines_lose_no_photo() {
    let scene = simple(6);
    scene.colmap_txt("sparse/0", &[pinhole()], &["00.png", "01.png", "02.png", "03.png", "04 a.png", "05.png"]);
    scene.photo("images/04 a.png", 12, 8);
    ["cameras", "images", "points3D"].iter().for_each(|stem| {
        fs::remove_file(scene.path().join(format!("sparse/0/{stem}.bin"))).expect("removed");
    });
    let path = scene.path().join("sparse/0/images.txt");
    let text = fs::read_to_string(&path).expect("text");
    let poses = |line: &&str| line.ends_with(".png") || line.starts_with('#');
    let alone = text.lines().filter(poses).map(|line| format!("{line}\r\n")).collect::<String>();
    let blank = text.replace("1.5 2.5 -1 3.0 4.0 7", "");
    for text in [text.clone(), alone, blank, format!("\u{feff}{text}")] {
        fs::write(&path, &text).expect("written");
        assert_eq!(open(&scene).unwrap_or_else(|error| panic!("{text:?}: {error}")).train.len(), 6, "{text:?}");
    }
}

#[test]
fn files_of_a_model_may_have_different_forms() {
    let scene = simple(2);
    scene.colmap_txt("other", &[pinhole()], &["00.png", "01.png"]);
    let (binary, text) = (scene.path().join("sparse/0"), scene.path().join("other"));
    for stem in ["cameras", "points3D"] {
        fs::remove_file(binary.join(format!("{stem}.bin"))).expect("removed");
        fs::copy(text.join(format!("{stem}.txt")), binary.join(format!("{stem}.txt"))).expect("copied");
    }
    let dataset = open(&scene).expect("a scene");
    assert_eq!((dataset.train.len(), dataset.points.len()), (2, POINTS.len()));
    // The points file of a trainer is used if the model has none.
    fs::remove_file(binary.join("points3D.txt")).expect("removed");
    scene.write("sparse/0/points3D.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n1 2 3 4 5 6\n");
    let dataset = open(&scene).expect("a scene");
    assert_eq!((dataset.points.len(), dataset.points[0].colour), (1, [4, 5, 6]));
    noted(&dataset.notes, &["points3D.ply"]);
}

#[test]
fn one_broken_pose_leaves_its_photo_out() {
    let scene = simple(12);
    let path = scene.path().join("sparse/0/images.bin");
    let mut bytes = fs::read(&path).expect("bytes");
    // The first number of the first rotation.
    bytes[12..20].copy_from_slice(&f64::NAN.to_le_bytes());
    fs::write(&path, bytes).expect("written");
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.train.len(), 11);
    noted(&dataset.notes, &["1 of 12", "00.png"]);
    let none = LoadOptions { max_bad_photos: 0.0, ..LoadOptions::default() };
    assert!(refusal(scenes::open(scene.path(), &none)).contains("remove the image"));
}

#[test]
fn one_broken_row_leaves_its_photo_or_point_out() {
    let all: Vec<String> = (0..12).map(|index| format!("{index:02}.png")).collect();
    let names: Vec<&str> = all.iter().map(String::as_str).collect();
    let scene = Scene::new();
    scene.colmap_txt("sparse/0", &[pinhole()], &names);
    names.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    let path = scene.path().join("sparse/0/images.txt");
    let text = fs::read_to_string(&path).expect("text");
    let of_last =
        |row: &str| format!("{}\n{row}\n\n", text[..text.find("\n12 ").expect("the last")].trim_end_matches('\n'));
    for row in ["12 0.9 0 0 0 1 2 -nan(ind) 1 11.png", "12 0.9 0 0 0 1 2 3 7 11.png"] {
        fs::write(&path, of_last(row)).expect("written");
        let dataset = open(&scene).expect("a scene");
        assert_eq!(dataset.all().len(), 11, "{row}");
        noted(&dataset.notes, &["1 of 12"]);
    }
    // A file that ends within a row was truncated, and may have lost more than that row.
    fs::write(&path, of_last("12 0.9 0 0 0 1 2").trim_end()).expect("written");
    assert!(refusal(open(&scene)).contains("the line ends where"));
    fs::write(&path, &text).expect("written");
    let path = scene.path().join("sparse/0/points3D.txt");
    let text = fs::read_to_string(&path).expect("text");
    fs::write(&path, format!("{text}9 1 2 x 0 0 0\n")).expect("written");
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.points.len(), POINTS.len());
    noted(&dataset.notes, &["1 point omitted", "`x`"]);
}

#[test]
fn another_model_is_named_with_its_photos_and_can_be_the_scene() {
    let scene = simple(5);
    scene.colmap_bin("sparse/0", &[pinhole()], &["00.png"]);
    scene.colmap_bin("sparse/1", &[pinhole()], &["01.png", "02.png", "03.png", "04.png"]);
    let dataset = open(&scene).expect("a scene");
    assert_eq!(dataset.flaws.len(), 2, "{:?}", dataset.flaws);
    let notes = dataset.notes;
    noted(&notes, &["4 of 5 photos", "have no pose"]);
    noted(&notes, &["with 1 photo;", "has 4"]);
    let other = scenes::open(&scene.path().join("sparse/1"), &LoadOptions::default()).expect("a scene");
    assert_eq!(other.all().len(), 4);
}

#[test]
fn a_second_kind_of_scene_is_named() {
    let scene = simple(2);
    let json = r#"{"fl_x": 10, "frames": [{"file_path": "images/00.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"#;
    scene.write("transforms.json", json);
    let notes = open(&scene).expect("a scene").notes;
    noted(&notes, &["2 photos come", "transforms.json with 1 photo"]);
    fs::remove_dir_all(scene.path().join("images")).expect("removed");
    assert!(refusal(open(&scene)).contains("or name"));
}
