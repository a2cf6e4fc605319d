//! `labelgs check`: a sound capture has no findings, and each fault is found in the photo that has it.

use assert_cmd::Command;
use labelgs::io::capture::{Fault, Report, scan};
use labelgs::io::{LoadOptions, open};
use labelgs::scene::{Dataset, Photo};
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
fn found(report: &Report) -> Vec<(Fault, Option<&str>)> {
    report.findings.iter().map(|finding| (finding.fault, finding.view.as_deref())).collect()
}

/// Scans a scene with one photo changed.
fn with_photo(scene: &Path, index: usize, change: impl Fn(&mut Photo)) -> Report {
    let mut dataset = read(scene);
    dataset.train[index].photo.as_mut().expect("a photo").edit(change).expect("in memory");
    scan(scene, &dataset).expect("a scan")
}

#[test]
fn each_fault_is_found_in_its_photo() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = made(folder.path());
    let sound = scan(&scene, &read(&scene)).expect("a scan");
    assert_eq!(found(&sound), [], "{sound:?}");
    assert!(sound.reprojection.expect("observations") < 1.0 && sound.gain_spread.expect("gains") < 1.1, "{sound:?}");

    let dark = with_photo(&scene, 3, |photo| {
        photo
            .rgba
            .iter_mut()
            .flat_map(|texel| &mut texel[..3])
            .for_each(|value| *value = (f32::from(*value) * 0.7) as u8);
    });
    assert_eq!(found(&dark), [(Fault::Exposure, Some("003.png"))]);
    assert!((dark.views[3].gain.expect("a gain") - 0.7).abs() < 0.05, "{:?}", dark.views[3]);

    let tinted = with_photo(&scene, 4, |photo| {
        photo.rgba.iter_mut().for_each(|texel| texel[2] = (f32::from(texel[2]) * 0.8) as u8);
    });
    assert_eq!(found(&tinted), [(Fault::WhiteBalance, Some("004.png"))]);
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
    assert_eq!(found(&blurred), [(Fault::Blur, Some("005.png"))]);

    let mut stray = read(&scene);
    stray.points[7].position *= 1e5;
    assert_eq!(found(&scan(&scene, &stray).expect("a scan")), [(Fault::Scale, None)]);
}

/// A pose that is off moves its points; a photo without observations shares nothing. The command names both, with cures.
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
    assert!(output.status.success() && text.contains("16 photos, ") && text.contains("nothing found"), "{text}");

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
    assert!(finding["cure"].as_str().is_some_and(|cure| cure.contains("leave the photo out")), "{finding}");

    let mut alone = read(&scene);
    let camera = &mut alone.train[9].camera;
    camera.translation.z -= 50.0;
    let report = scan(&scene, &alone).expect("a scan");
    assert!(found(&report).contains(&(Fault::Alone, Some("009.png"))), "{:?}", report.findings);
}
