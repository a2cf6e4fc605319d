//! `tools/photos`: what it refuses before COLMAP has any work.

use crate::support::runs::stderr;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn photos(folder: &Path, args: &[&str]) -> Output {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/photos");
    Command::new("bash").arg(script).args(args).current_dir(folder).output().expect("bash")
}

#[test]
fn wrong_calls_say_what_to_do_and_leave_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    fs::create_dir(path.join("photos")).expect("a folder");
    fs::create_dir(path.join("scene")).expect("a folder");
    for (args, expected) in [
        (&[][..], "expected one folder of photos or one video, found 0"),
        (&["photos"], "-o SCENE is missing"),
        (&["photos", "-o"], "-o needs a value"),
        (&["photos", "-o", "scene"], "exists; name a new folder"),
        (&["nowhere", "-o", "new"], "there is no nowhere"),
        (&["photos", "-o", "new", "--frames", "two"], "--frames two: expected a number of 3 or more"),
        (&["photos", "-o", "new", "--fast"], "there is no flag --fast"),
    ] {
        let output = photos(path, args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains(expected), "{args:?}: {}", stderr(&output));
        assert!(!path.join("new").exists(), "{args:?}");
    }
    let help = photos(path, &["--help"]);
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(help.status.success() && text.contains("DIR|VIDEO -o SCENE") && !text.contains("pipefail"), "{text}");
}
