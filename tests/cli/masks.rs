//! `labelgs masks`: output files and exit statuses.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

fn labelgs(args: &[&str]) -> Output {
    Command::cargo_bin("labelgs").expect("the tool is built").args(args).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

#[track_caller]
fn json(output: &Output, status: i32) -> Value {
    assert_eq!(output.status.code(), Some(status), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON alone on standard output")
}

#[test]
fn imported_masks_pass_the_check_until_they_are_broken() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let scene = at("scene");
    let made = ["synth", &scene, "--size", "64x48", "--views", "9", "--points", "300", "--preset", "simple"];
    assert_eq!(labelgs(&made).status.code(), Some(0));
    let (source, masks) = (at("scene/masks"), at("masks"));
    let done = json(&labelgs(&["masks", "import", &source, "--scene", &scene, "-o", &masks, "--json"]), 0);
    assert_eq!((&done["schema_version"], &done["import"]["format"]), (&1.into(), &"deva-short".into()));
    assert_eq!((&done["import"]["masks"], &done["import"]["bits"]), (&9.into(), &8.into()));
    assert_eq!(done["import"]["labels"][2]["source"], "3");
    // The ids of the ground truth are 1 and up without gaps, so import keeps them.
    for entry in fs::read_dir(&source).expect("folder") {
        let path = entry.expect("entry").path();
        if path.extension().is_none_or(|extension| extension != "png") {
            continue; // labels.json
        }
        let again = Path::new(&masks).join(path.file_name().expect("a name"));
        let ids = |path: &Path| labelgs::masks::read_mask(path).expect("a mask");
        assert_eq!(ids(&path), ids(&again));
    }
    let check = ["masks", "check", &masks, "--scene", &scene];
    let output = labelgs(&check);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
    assert!(text(&output.stdout).contains("9 masks for 9 photos, 3 ids\nno problems found"));

    let full = labelgs(&["masks", "import", &source, "--scene", &scene, "-o", &masks]);
    assert_eq!(full.status.code(), Some(2));
    assert!(text(&full.stderr).contains("not empty"));

    fs::rename(Path::new(&masks).join("004.png"), Path::new(&masks).join("4.png")).expect("renamed");
    let output = labelgs(&check);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("1 missing, 1 misnamed"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("4.png does not belong to any photo"), "{}", text(&output.stdout));
    let report = json(&labelgs(&[&check[..], &["--json"]].concat()), 1);
    assert_eq!((&report["counts"]["missing"], &report["report"]["masks"]), (&1.into(), &8.into()));
    assert_eq!(report["report"]["findings"][0]["problem"], "missing");
    assert_eq!(report["report"]["findings"][0]["view"], "004.png");

    let again = at("again");
    let output = labelgs(&["masks", "import", &masks, "--scene", &scene, "-o", &again]);
    assert_eq!(output.status.code(), Some(0));
    let warned = text(&output.stderr);
    assert!(warned.contains("1 masks belong to no photo") && warned.contains("1 of 9 photos have no mask"), "{warned}");
    assert!(text(&output.stdout).contains("deva-short") && text(&output.stdout).contains("8 masks for 9 photos"));
}

#[test]
fn every_flag_is_explained() {
    let root = labelgs::cli::command::command();
    let masks = root.find_subcommand("masks").expect("masks");
    for verb in masks.get_subcommands() {
        assert!(verb.get_about().is_some());
        for arg in verb.get_arguments() {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.len() > 8 || arg.get_id() == "json_here", "{} {}", verb.get_name(), arg.get_id());
        }
    }
    assert_eq!(labelgs(&["masks"]).status.code(), Some(2));
    let wrong = ["masks", "import", "x", "--scene", "y", "-o", "z", "--format", "jpeg"];
    assert!(text(&labelgs(&wrong).stderr).contains("3d-ovs"));
}
