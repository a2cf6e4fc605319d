//! Videos are encoded by a stand-in for ffmpeg.
#![cfg(unix)]

use super::fixtures::Scene;
use labelgs_files::video;
use labelgs_scene::Error;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

/// Set in the child process to the folder with the encoder.
const CHILD_VARIABLE: &str = "LABELGS_TEST_VIDEO";

/// The search path applies to a whole process, so each test runs again in its own process. Returns the folder there.
fn with_encoder(test: &str, script: Option<&str>) -> Option<PathBuf> {
    if let Some(folder) = env::var_os(CHILD_VARIABLE) {
        return Some(folder.into());
    }
    let scene = Scene::new();
    let mut path = scene.path().display().to_string();
    if let Some(script) = script {
        let encoder = scene.write("ffmpeg", format!("#!/bin/sh\n{script}\n"));
        fs::set_permissions(&encoder, fs::Permissions::from_mode(0o755)).expect("a program");
        path += ":/usr/bin:/bin";
    }
    let mut child = Command::new(env::current_exe().expect("this test"));
    child.args(["--exact", &format!("videos::{test}")]).env("PATH", path).env(CHILD_VARIABLE, scene.path());
    let output = child.output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    None
}

#[test]
fn frames_reach_the_encoder_whole_and_in_order() {
    let script = r#"for last; do :; done; echo "$@" > "$(dirname "$0")/words"; exec cat > "$last""#;
    let Some(folder) = with_encoder("frames_reach_the_encoder_whole_and_in_order", Some(script)) else { return };
    let file = folder.join("new/clip.mp4");
    let frame = |value: u8| vec![[value, 1, 2]; 4 * 2];
    video::write(&file, (4, 2), 29.97, |push| (0..50).try_for_each(|value| push(&frame(value)))).expect("a video");
    let expected: Vec<u8> = (0..50).flat_map(frame).flatten().collect();
    assert_eq!(fs::read(&file).expect("a file"), expected);
    let words = fs::read_to_string(folder.join("words")).expect("words");
    for part in ["-video_size 4x2", "-pixel_format rgb24", "-framerate 29.97", "-pix_fmt yuv420p", "-f mp4"] {
        assert!(words.contains(part), "{words}");
    }
    // A failing frame ends the video; the old file stays.
    let failed = video::write(&file, (4, 2), 30.0, |push| {
        push(&frame(7))?;
        Err(Error::Interrupted)
    });
    assert!(matches!(failed, Err(Error::Interrupted)), "{failed:?}");
    assert_eq!(fs::read(&file).expect("the old file"), expected);
    assert_eq!(fs::read_dir(folder.join("new")).expect("a folder").count(), 1, "no litter");
    assert!(matches!(video::write(&file, (3, 2), 30.0, |_| Ok(())), Err(Error::Bug(_))));
}

#[test]
fn an_encoder_that_fails_says_why() {
    let script = "echo 'Unknown encoder: none here' >&2; exit 3";
    let Some(folder) = with_encoder("an_encoder_that_fails_says_why", Some(script)) else { return };
    let file = folder.join("clip.mp4");
    // More than a pipe holds, so that a write hits the closed end.
    let error = video::write(&file, (512, 512), 30.0, |push| (0..9).try_for_each(|_| push(&[[0; 3]; 512 * 512])))
        .expect_err("it failed")
        .to_string();
    assert!(
        error.contains("clip.mp4") && error.contains("Unknown encoder: none here") && error.contains('3'),
        "{error}"
    );
    assert!(!file.exists());
}

#[test]
fn a_missing_encoder_is_named() {
    let Some(folder) = with_encoder("a_missing_encoder_is_named", None) else { return };
    let file = folder.join("clip.mp4");
    let write = || video::write(&file, (2, 2), 30.0, |_| panic!("no frame is drawn for nobody"));
    for error in [video::find_encoder(&file).map(drop), write()].map(|done| done.expect_err("no encoder").to_string()) {
        assert!(error.contains("apt-get install ffmpeg") && error.contains("name a folder"), "{error}");
    }
}
