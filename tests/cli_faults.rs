//! The tool under faults made on purpose: statuses as README lists them, nothing half-written, nothing lost.
//!
//! `LABELGS_TEST_FAULTS=all` tries every event in place of some.

use crate::support::device;
use crate::support::runs::{Place, all_whole, files, stderr, succeeded};
use std::process::Output;

/// The events that are tried: the first few, then fewer and fewer.
fn events() -> impl Iterator<Item = u32> {
    let all = std::env::var("LABELGS_TEST_FAULTS").is_ok_and(|value| value == "all");
    std::iter::successors(Some(1_u32), move |&n| Some(if all || n < 3 { n + 1 } else { n + n / 2 }))
}

#[track_caller]
fn status(output: &Output, allowed: &[i32], what: &str) -> i32 {
    let status = output.status.code().unwrap_or_else(|| panic!("{what}: killed; {}", stderr(output)));
    assert!(allowed.contains(&status), "{what}: status {status}; {}", stderr(output));
    assert!(!stderr(output).contains("bug in labelgs"), "{what}: {}", stderr(output));
    status
}

/// Whatever Vulkan call fails, `render` ends with the status of the failure and leaves whole pictures or none.
#[test]
fn any_vulkan_call_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "2"]));
    let (model, scene) = (place.text("out"), place.text("scene"));
    for (kind, allowed) in [
        ("DEVICE_LOST", &[0, 4, 6][..]),
        ("HOST_MEMORY", &[0, 4, 5]),
        ("DEVICE_MEMORY", &[0, 4, 5]),
        ("INITIALIZATION", &[0, 4]),
    ] {
        let mut tried = 0;
        for nth in events() {
            let (fault, out) = (format!("vulkan:{nth}:{kind}"), format!("pictures-{kind}-{nth}"));
            let args = ["render", &model, "--scene", &scene, "-o", &place.text(&out)];
            let output = place.faulty(&args, Some(&fault));
            let status = status(&output, allowed, &fault);
            all_whole(&place.path(&out));
            tried += 1;
            // Some calls can fail without harm (caches of pipelines), so success alone says nothing before a while.
            if status == 0 && nth > 500 {
                break;
            }
        }
        println!("{kind}: {tried} of the Vulkan calls of a render");
        assert!(tried > 8, "{kind}: only {tried} calls were made to fail");
    }
}

/// A full or broken disk at any moment of a training: its status, whole files, and a run that goes on afterwards.
#[test]
fn any_write_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings(), "--iterations", "10"];
    succeeded(&place.trained("right", &flags));
    let expected = place.model("right", 10);
    let (mut tried, mut failed) = (0, 0);
    for (index, nth) in events().enumerate() {
        let kind = ["NO_SPACE", "IO"][index % 2];
        let (fault, out) = (format!("write:{nth}:{kind}"), format!("out-{nth}"));
        let output = place.trained_with(Some(&fault), &out, &flags);
        let status = status(&output, &[0, 7], &fault);
        all_whole(&place.path(&out));
        let left = files(&place.path(&out));
        let is_temporary = |path: &&std::path::PathBuf| path.extension().is_some_and(|e| e == "tmp");
        assert_eq!(left.iter().filter(is_temporary).count(), 0, "{fault}: {left:?}");
        tried += 1;
        if status == 7 {
            failed += 1;
            assert!(stderr(&output).contains("cannot be written"), "{fault}: {}", stderr(&output));
            let mut again = flags.to_vec();
            again.push("--resume");
            succeeded(&place.trained(&out, &again));
        } else if nth > 300 {
            break;
        }
        assert!(place.model(&out, 10) == expected, "{fault}: another model than without the fault");
    }
    println!("{tried} writes of a training were made to fail, {failed} of them ended it");
    assert!(failed > 3, "only {failed} of {tried} faults ended the training");
}

/// A number that is none, in the memory of a device that goes wrong once: the training goes back, and ends as it would
/// have.
#[test]
fn a_number_that_is_none_is_found_and_undone() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings()];
    succeeded(&place.trained("right", &flags));
    let said = succeeded(&place.trained_with(Some("nan:27:NUMBER"), "healed", &flags));
    assert!(
        said.contains("1 Gaussians with parameters that are not finite, the first is 0")
            && said.contains("cull")
            && said.contains("view ")
            && said.contains("goes back to"),
        "{said}"
    );
    assert!(place.model("healed", 40) == place.model("right", 40), "healed, the model is the same");
    // Before there is a checkpoint there is nothing to go back to.
    let output = place.trained_with(Some("nan:2:NUMBER"), "lost", &flags);
    assert_eq!(output.status.code(), Some(8), "{}", stderr(&output));
    assert!(stderr(&output).contains("numerical failure at step 2, view "), "{}", stderr(&output));
    all_whole(&place.path("lost"));
}

/// Two runs in one folder would write over each other.
#[test]
fn a_folder_has_one_run_at_a_time() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    std::fs::create_dir_all(place.path("out")).expect("a folder");
    let lock = labelgs::io::run_folder::lock(&place.path("out")).expect("the first run");
    let output = place.trained("out", &["--iterations", "1"]);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("another labelgs trains into this folder"), "{}", stderr(&output));
    drop(lock);
    succeeded(&place.trained("out", &["--iterations", "1"]));
}
