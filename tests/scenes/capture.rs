//! `labelgs check`: a sound capture has no findings, and each fault is found in the photo that has it.

use assert_cmd::Command;
use glam::DVec3;
use labelgs::scene::{Dataset, Photo, Point};
use labelgs::scenes::capture::{CaptureProblem, Report, scan};
use labelgs::scenes::{LoadOptions, Lookup, open};
use std::path::{Path, PathBuf};

/// A made scene of 16 photos.
fn made(folder: &Path) -> PathBuf {
    let scene = folder.join("scene");
    let size = ["--size", "160x120", "--views", "16", "--points", "1500"];
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.arg("synth").arg(&scene).args(size).assert().success();
    scene
}

fn read(scene: &Path) -> Dataset {
    open(scene, &LoadOptions { test_every: None, ..LoadOptions::default() }).expect("a scene")
}

/// Kinds and photos of the findings.
fn found(report: &Report) -> Vec<(CaptureProblem, Option<&str>)> {
    report.findings.iter().map(|finding| (finding.fault, finding.view.as_deref())).collect()
}

/// Scans a scene with one photo changed.
fn with_photo(scene: &Path, index: usize, change: impl Fn(&mut Photo)) -> Report {
    let mut dataset = read(scene);
    dataset.train[index].photo.as_mut().expect("a photo").edit(change).expect("in memory");
    scan(scene, &Lookup::default(), &dataset).expect("a scan")
}

/// A list of poses beside a COLMAP model is of a world of its own: what the model observed says nothing about it.
#[test]
fn observations_are_those_of_the_list_that_was_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let frame = |index: usize| {
        let matrix = format!("[[1,0,0,{index}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
        format!(r#"{{"file_path": "images/{index:03}.png", "transform_matrix": {matrix}}}"#)
    };
    let frames = (0..16).map(frame).collect::<Vec<_>>().join(",");
    let list = scene.join("transforms.json");
    std::fs::write(&list, format!(r#"{{"fl_x": 120, "frames": [{frames}]}}"#)).expect("written");
    let report = |named: &Path| scan(named, &Lookup::default(), &read(named)).expect("a scan");
    assert!(report(&scene).reprojection.is_some());
    let other = report(&list);
    assert_eq!(other.reprojection, None, "{other:?}");
    assert!(other.findings.iter().all(|finding| finding.fault != CaptureProblem::Reprojection), "{other:?}");
}

#[test]
fn each_fault_is_found_in_its_photo() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let sound = scan(&scene, &Lookup::default(), &read(&scene)).expect("a scan");
    assert_eq!(found(&sound), [], "{sound:?}");
    assert!(sound.reprojection.expect("observations") < 1.0 && sound.gain_spread.expect("gains") < 1.1, "{sound:?}");

    let dark = with_photo(&scene, 3, |photo| {
        photo
            .rgba
            .iter_mut()
            .flat_map(|texel| &mut texel[..3])
            .for_each(|value| *value = (f32::from(*value) * 0.7) as u8);
    });
    assert_eq!(found(&dark), [(CaptureProblem::Exposure, Some("003.png"))]);
    assert!((dark.views[3].gain.expect("a gain") - 0.7).abs() < 0.05, "{:?}", dark.views[3]);

    let tinted = with_photo(&scene, 4, |photo| {
        photo.rgba.iter_mut().for_each(|texel| texel[2] = (f32::from(texel[2]) * 0.8) as u8);
    });
    assert_eq!(found(&tinted), [(CaptureProblem::WhiteBalance, Some("004.png"))]);
    let [red, green, blue] = tinted.views[4].channel_gains.expect("gains");
    assert!((blue / red - 0.8).abs() < 0.05 && (green / red - 1.0).abs() < 0.05, "{:?}", tinted.views[4]);

    let blurred = with_photo(&scene, 5, |photo| {
        // Means of 5 x 5 pixels.
        let (before, width, height) = (photo.rgba.clone(), photo.width as i32, photo.height as i32);
        for (index, texel) in photo.rgba.iter_mut().enumerate() {
            let (x, y) = (index as i32 % width, index as i32 / width);
            for channel in 0..3 {
                let at = |dx: i32, dy: i32| {
                    let (x, y) = ((x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1));
                    u32::from(before[(y * width + x) as usize][channel])
                };
                let sum: u32 =
                    (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))).map(|(dx, dy)| at(dx, dy)).sum();
                texel[channel] = (sum / 25) as u8;
            }
        }
    });
    assert_eq!(found(&blurred), [(CaptureProblem::Blur, Some("005.png"))]);

    let mut stray = read(&scene);
    stray.points[7].position *= 1e5;
    assert_eq!(found(&scan(&scene, &Lookup::default(), &stray).expect("a scan")), [(CaptureProblem::Scale, None)]);
}

/// Places of the parts of `images.bin`: of each image its pose, and the number of its points with what follows them.
fn images(bytes: &[u8]) -> Vec<(usize, std::ops::Range<usize>)> {
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize;
    let mut at = 8;
    (0..number(0))
        .map(|_| {
            let pose = at + 4;
            let name = pose + 56 + 4;
            let end = name + bytes[name..].iter().position(|&byte| byte == 0).expect("a name") + 1;
            at = end + 8 + 24 * number(end);
            (pose, end..at)
        })
        .collect()
}

/// Turns poses around: x stays, y and z point the other way, as in OpenGL.
fn turn(scene: &Path, which: impl Fn(usize) -> bool) {
    let path = scene.join("sparse/0/images.bin");
    let mut bytes = std::fs::read(&path).expect("images");
    for (pose, _) in images(&bytes).into_iter().enumerate().filter(|(index, _)| which(*index)).map(|(_, of)| of) {
        let mut values = [0, 1, 2, 3, 4, 5, 6]
            .map(|at| f64::from_le_bytes(bytes[pose + 8 * at..][..8].try_into().expect("eight bytes")));
        let [w, x, y, z, ..] = values;
        values[..4].copy_from_slice(&[-x, w, -z, y]);
        values[5] = -values[5];
        values[6] = -values[6];
        bytes[pose..pose + 56].copy_from_slice(&values.map(f64::to_le_bytes).concat());
    }
    std::fs::write(&path, bytes).expect("written");
}

/// Points behind the cameras have no distance in pixels. Where it is most photos, their poses have one fault.
#[test]
fn points_behind_the_cameras_are_a_finding_of_the_photo_or_of_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let sound = scan(&scene, &Lookup::default(), &read(&scene)).expect("a scan");
    turn(&scene, |index| index < 3);
    let few = scan(&scene, &Lookup::default(), &read(&scene)).expect("a scan");
    let photos = ["000.png", "001.png", "002.png"];
    assert_eq!(found(&few), photos.map(|name| (CaptureProblem::Behind, Some(name))), "{:?}", few.findings);
    let (view, points) = (&few.views[1], sound.views[1].points);
    // A few points lie at the edge of the photo.
    assert!(view.reprojection.is_none() && (points..points + 5).contains(&view.behind), "{view:?}");
    assert!(few.findings[1].text.starts_with(&format!("{0} of its {0} points lie behind", view.behind)));
    assert!(few.reprojection.is_some_and(|error| error < 1.0));

    turn(&scene, |index| (3..15).contains(&index));
    let most = scan(&scene, &Lookup::default(), &read(&scene)).expect("a scan");
    assert_eq!(found(&most), [(CaptureProblem::Behind, None)], "{:?}", most.findings);
    let finding = &most.findings[0];
    assert!(finding.text.starts_with("15 of 16 photos, such as 000.png: "), "{finding:?}");
    assert!(finding.cure.contains("axes") && !finding.cure.contains("leave"), "{finding:?}");
    turn(&scene, |index| index == 15);
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let output = command.arg("check").arg(&scene).arg("--json").output().expect("it runs");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(report["report"]["reprojection"].is_null() && report["report"]["views"][0]["reprojection"].is_null());
}

/// One fault of most photos is one finding, with a cure that is possible.
#[test]
fn photos_that_all_share_nothing_are_one_finding() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let mut dataset = read(&scene);
    for view in &mut dataset.train {
        view.camera.translation.z = -view.camera.translation.z;
    }
    let report = scan(&scene, &Lookup::default(), &dataset).expect("a scan");
    let alone: Vec<_> = report.findings.iter().filter(|finding| finding.fault == CaptureProblem::Alone).collect();
    assert!(matches!(alone[..], [one] if one.view.is_none() && one.text.starts_with("16 of 16 photos")), "{alone:?}");
    assert!(!alone[0].cure.contains("leave"), "{alone:?}");
}

/// The middle of the cameras and their distance from it are medians.
#[test]
fn a_camera_far_away_does_not_hide_a_stray_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let mut dataset = read(&scene);
    dataset.train[0].camera.translation.z += 2e4;
    assert!(
        !found(&scan(&scene, &Lookup::default(), &dataset).expect("a scan")).contains(&(CaptureProblem::Scale, None))
    );
    dataset.points[7].position *= 1e5;
    assert!(
        found(&scan(&scene, &Lookup::default(), &dataset).expect("a scan")).contains(&(CaptureProblem::Scale, None))
    );
}

/// A laser scan has many points, and nothing says which photo shows which: a sample of them tells how bright photos
/// are, and every point is counted.
#[test]
fn dense_points_tell_the_exposure_by_a_sample() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let path = scene.join("sparse/0/images.bin");
    let mut bytes = std::fs::read(&path).expect("images");
    for (_, points) in images(&bytes).into_iter().rev() {
        bytes.splice(points, 0_u64.to_le_bytes());
    }
    std::fs::write(&path, bytes).expect("written");
    let mut dataset = read(&scene);
    let near = |copy: usize| DVec3::new(0.001 * (copy % 5) as f64, 0.001 * (copy / 5) as f64, 0.0);
    let copies =
        |point: &Point| (0..20).map(|copy| Point { position: point.position + near(copy), ..*point }).collect();
    dataset.points = dataset.points.iter().flat_map::<Vec<Point>, _>(copies).collect();
    dataset.train[3]
        .photo
        .as_mut()
        .expect("a photo")
        .edit(|photo| {
            photo.rgba.iter_mut().flat_map(|texel| &mut texel[..3]).for_each(|value| *value = *value / 10 * 7)
        })
        .expect("in memory");
    let report = scan(&scene, &Lookup::default(), &dataset).expect("a scan");
    assert_eq!(found(&report), [(CaptureProblem::Exposure, Some("003.png"))], "{:?}", report.findings);
    let view = &report.views[3];
    assert!(view.points > 5000 && view.reprojection.is_none(), "{view:?}");
    assert!((view.gain.expect("a gain") - 0.7).abs() < 0.05, "{view:?}");
}

/// A pose that is off moves its points; a photo without observations shares nothing. The command names both, with
/// cures.
#[test]
fn wrong_poses_and_lonely_photos_are_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let check = |args: &[&str]| {
        let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
        command.arg("check").arg(&scene).args(args).output().expect("it runs")
    };
    let output = check(&[]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("16 photos, ") && text.contains("no problems found"), "{text}");

    let path = scene.join("sparse/0/images.bin");
    let mut bytes = std::fs::read(&path).expect("images");
    // The number of images, then the id and the rotation of the first, then its translation.
    let at = 8 + 4 + 32;
    let x = f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) + 0.3;
    bytes[at..at + 8].copy_from_slice(&x.to_le_bytes());
    std::fs::write(&path, bytes).expect("written");
    let output = check(&["--json"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let finding = &report["report"]["findings"][0];
    assert_eq!((&finding["fault"], &finding["view"]), (&"reprojection".into(), &"000.png".into()), "{report}");
    assert!(finding["cure"].as_str().is_some_and(|cure| cure.contains("remove the photo")), "{finding}");

    let mut alone = read(&scene);
    let camera = &mut alone.train[9].camera;
    camera.translation.z -= 50.0;
    let report = scan(&scene, &Lookup::default(), &alone).expect("a scan");
    assert!(found(&report).contains(&(CaptureProblem::Alone, Some("009.png"))), "{:?}", report.findings);
}
