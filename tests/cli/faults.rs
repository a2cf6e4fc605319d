//! The program under injected faults: exit statuses as README.md lists them, no partial files, no lost results.
//!
//! Event N of a kind fails, for rising N until a command ends before it. `LABELGS_TEST_FAULTS=all` tries every N.

use crate::support::device;
use crate::support::runs::{Place, all_whole, contents, copy, files, stderr, succeeded};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

fn all() -> bool {
    std::env::var("LABELGS_TEST_FAULTS").is_ok_and(|value| value == "all")
}

/// Event numbers to try: the first few, then at growing distances.
fn events() -> impl Iterator<Item = u32> {
    std::iter::successors(Some(1_u32), |&n| Some(if all() || n < 3 { n + 1 } else { n + n / 2 }))
}

/// Kinds of faults with the event numbers to try: every kind at each number, or the kinds in turn.
fn cases(kinds: &'static [&str]) -> impl Iterator<Item = (&'static str, u32)> {
    let each = if all() { kinds.len() } else { 1 };
    events()
        .enumerate()
        .flat_map(move |(turn, nth)| (0..each).map(move |kind| (kinds[(turn + kind) % kinds.len()], nth)))
}

/// Whether the command reached the event that fails.
fn met(output: &Output) -> bool {
    stderr(output).contains("injected fault")
}

#[track_caller]
fn status(output: &Output, allowed: &[i32], what: &str) -> i32 {
    let status = output.status.code().unwrap_or_else(|| panic!("{what}: killed; {}", stderr(output)));
    assert!(allowed.contains(&status), "{what}: status {status}; {}", stderr(output));
    assert!(!stderr(output).contains("bug in labelgs"), "{what}: {}", stderr(output));
    status
}

/// If any Vulkan call fails, `render` ends with the status of the failure and leaves complete pictures or none.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
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
        let (mut tried, mut harmless) = (0, 0);
        for nth in events() {
            let (fault, out) = (format!("vulkan:{nth}:{kind}"), format!("pictures-{kind}-{nth}"));
            let args = ["render", &model, "--scene", &scene, "-o", &place.text(&out)];
            let output = place.faulty(&args, Some(&fault));
            let status = status(&output, allowed, &fault);
            all_whole(&place.path(&out));
            if !met(&output) {
                assert_eq!(status, 0, "{fault}");
                break;
            }
            tried += 1;
            // Failures of pipeline caches are harmless.
            harmless += u32::from(status == 0);
        }
        println!("{kind}: {tried} of the Vulkan calls of a render, {harmless} of them harmless");
        assert!(
            tried > 8 && harmless * 2 < tried,
            "{kind}: {tried} calls were made to fail, {harmless} did not matter"
        );
    }
}

/// If any Vulkan call of a training fails: the right exit status, complete files, and a resumed run with the same bits.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn any_vulkan_call_of_a_training_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    // Six steps with votes, densification, a checkpoint and a preview.
    std::fs::write(place.path("short.toml"), SHORT).expect("settings");
    let short = place.text("short.toml");
    let flags = ["--config", &short];
    succeeded(&place.trained("right", &flags));
    let expected = place.model("right", 6);
    let (mut tried, mut failed) = (0, 0);
    for (kind, nth) in cases(&["DEVICE_LOST", "HOST_MEMORY", "DEVICE_MEMORY", "INITIALIZATION"]) {
        let (fault, out) = (format!("vulkan:{nth}:{kind}"), format!("out-{nth}-{kind}"));
        let output = place.trained_with(Some(&fault), &out, &flags);
        let allowed = match kind {
            "DEVICE_LOST" => &[0, 4, 6][..],
            "INITIALIZATION" => &[0, 4],
            _ => &[0, 4, 5],
        };
        let status = status(&output, allowed, &fault);
        all_whole(&place.path(&out));
        if !met(&output) {
            assert_eq!(status, 0, "{fault}");
            break;
        }
        (tried, failed) = (tried + 1, failed + u32::from(status != 0));
        let said = stderr(&output);
        if status == 6 {
            assert!(said.contains("the device was lost; the last pass known to have started is"), "{fault}: {said}");
        }
        if status != 0 {
            succeeded(&place.trained(&out, &[&flags[..], &["--resume"]].concat()));
        }
        let is_bounded = said.contains("the number of Gaussians stays at");
        assert!(
            is_bounded || place.model(&out, 6) == expected,
            "{fault}: another model than without the fault; {said}"
        );
    }
    println!("{tried} Vulkan calls of a training were made to fail, {failed} of them ended it");
    assert!(tried > 8 && failed * 2 > tried, "{failed} of {tried}");
}

const SHORT: &str = "
iterations = 6
start_size = 1.0
checkpoint_every = 3
preview_every = 4
label_from = 2
vote_every = 2
densify_from = 1
densify_interval = 2
densify_grad_threshold = 1e-4
";

/// If any write of a training fails: the right exit status, complete files, and a run that can be resumed.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn any_write_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings(), "--iterations", "10"];
    succeeded(&place.trained("right", &flags));
    let expected = place.model("right", 10);
    let (mut tried, mut failed) = (0, 0);
    // The first write opens the history, which a training goes on without.
    for (kind, nth) in cases(&["SHORT", "NO_SPACE", "IO", "INTERRUPTED"]) {
        let (fault, out) = (format!("write:{nth}:{kind}"), format!("out-{nth}-{kind}"));
        let output = place.trained_with(Some(&fault), &out, &flags);
        let status = status(&output, &[0, 7], &fault);
        all_whole(&place.path(&out));
        let left = files(&place.path(&out));
        let is_temporary = |path: &&std::path::PathBuf| path.extension().is_some_and(|e| e == "tmp");
        assert_eq!(left.iter().filter(is_temporary).count(), 0, "{fault}: {left:?}");
        if !met(&output) {
            assert_eq!(status, 0, "{fault}");
            break;
        }
        tried += 1;
        if status == 7 {
            failed += 1;
            assert!(["NO_SPACE", "IO"].contains(&kind), "{fault}: {}", stderr(&output));
            assert!(stderr(&output).contains("cannot be written"), "{fault}: {}", stderr(&output));
            let mut again = flags.to_vec();
            again.push("--resume");
            succeeded(&place.trained(&out, &again));
        }
        assert!(place.model(&out, 10) == expected, "{fault}: another model than without the fault");
    }
    println!("{tried} writes of a training were made to fail, {failed} of them ended it");
    assert!(failed > 3, "only {failed} of {tried} faults ended the training");
}

/// If any read fails: status 3 and the name of the file, or the same result as without the fault.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn any_read_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let (scene, settings) = (place.text("scene"), place.settings());
    succeeded(&place.trained("begun", &["--config", &settings, "--iterations", "4"]));
    let run = |verb: &str, out: &str, fault: Option<&str>| {
        let flags = ["--config", &settings, "--iterations", "8", "--resume"];
        match verb {
            "train" => place.trained_with(fault, out, &flags[..4]),
            "resume" => {
                copy(&place.path("begun"), &place.path(out));
                place.trained_with(fault, out, &flags)
            }
            _ => {
                let to = place.text(out);
                place.faulty(&["render", &place.text("begun"), "--scene", &scene, "--views", "all", "-o", &to], fault)
            }
        }
    };
    for verb in ["train", "resume", "render"] {
        succeeded(&run(verb, verb, None));
        let expected = results(&place.path(verb));
        let (mut tried, mut failed) = (0, 0);
        for (kind, nth) in cases(&["IO", "SHORT", "INTERRUPTED"]) {
            let (fault, out) = (format!("read:{nth}:{kind}"), format!("{verb}-{nth}-{kind}"));
            let output = run(verb, &out, Some(&fault));
            let status = status(&output, &[0, 3], &fault);
            all_whole(&place.path(&out));
            if !met(&output) {
                assert_eq!(status, 0, "{fault}");
                break;
            }
            tried += 1;
            if status == 0 {
                assert!(
                    results(&place.path(&out)) == expected,
                    "{verb}, {fault}: another result than without the fault"
                );
            } else {
                failed += 1;
                assert_eq!(kind, "IO", "{verb}, {fault}: {}", stderr(&output));
                assert!(
                    stderr(&output).contains(": cannot be read: injected fault"),
                    "{verb}, {fault}: {}",
                    stderr(&output)
                );
            }
        }
        println!("{tried} reads of {verb} were made to fail, {failed} of them ended it");
        assert!(failed > 0 && tried > 6, "{verb}: {failed} of {tried}");
    }
}

/// Models and pictures of a folder, by their path in it.
fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let found = contents(folder, |path| path.extension().is_some_and(|kind| kind == "ply" || kind == "png"));
    assert!(!found.is_empty(), "{} has no result", folder.display());
    found
}

/// A lost device is opened again, and the message names the pass that was running. A second loss before the next
/// checkpoint ends the run.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_lost_device_is_opened_again() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let settings = place.settings();
    let flags = ["--config", &settings, "--restart"];
    succeeded(&place.trained("right", &flags[..2]));
    let expected = place.model("right", 40);
    let (mut healed, mut named, mut lost) = (0, 0, 0);
    for nth in events() {
        let (fault, out) = (format!("vkQueueSubmit:{nth}:DEVICE_LOST"), format!("out-{nth}"));
        let output = place.trained_with(Some(&fault), &out, &flags);
        let (status, said) = (status(&output, &[0, 6], &fault), stderr(&output));
        all_whole(&place.path(&out));
        if !met(&output) {
            break;
        }
        assert!(said.contains("the device was lost; the last pass known to have started is"), "{fault}: {said}");
        if status == 0 {
            healed += 1;
            assert!(said.contains("reopening it") && said.contains("resuming after step"), "{fault}: {said}");
            named += u32::from(said.contains(" of list "));
            assert!(place.model(&out, 40) == expected, "{fault}: another model than without the loss");
        } else {
            lost += 1;
        }
    }
    println!(
        "devices lost at {} of the submits of a training: {healed} made up for, the pass of {named} of them known",
        healed + lost
    );
    // The remaining losses happen during memory setup, before any pass.
    assert!(healed > 2 && lost > 2 && named > 0, "{healed} healed, {named} named, {lost} lost");
    // A driver may need a while until it has a device again.
    let fault = "vkQueueSubmit:300:DEVICE_LOST,vkEnumeratePhysicalDevices:2:INITIALIZATION";
    let said = succeeded(&place.trained_with(Some(fault), "slow", &flags));
    assert!(said.contains("trying again in 1 s") && place.model("slow", 40) == expected, "{said}");
    // `--restart` does not use checkpoints of an earlier run.
    let output =
        place.trained_with(Some("vkQueueSubmit:30:DEVICE_LOST"), "right", &["--restart", "--iterations", "40"]);
    assert_eq!(output.status.code(), Some(6), "{}", stderr(&output));
}

/// If an allocation is refused, the training ends with status 5, or goes on and reports a bound on the Gaussians.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn any_allocation_may_fail() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let settings = place.settings();
    let flags = ["--config", &settings, "--set", "densify_grad_threshold=1e-9"];
    succeeded(&place.trained("right", &flags));
    let expected = place.model("right", 40);
    let (mut tried, mut went_on, mut bounded) = (0, 0, 0);
    // One refusal is met by a smaller request, two or three by a bound on the Gaussians; many end the run.
    for (nth, count) in (1..).step_by(if all() { 1 } else { 13 }).zip([1, 2, 3, 40].into_iter().cycle()) {
        let (fault, out) = (format!("vkAllocateMemory:{nth}:DEVICE_MEMORY:{count}"), format!("out-{nth}"));
        let output = place.trained_with(Some(&fault), &out, &flags);
        let status = status(&output, &[0, 5], &fault);
        all_whole(&place.path(&out));
        if !met(&output) {
            break;
        }
        tried += 1;
        let model = if status == 0 {
            went_on += 1;
            bounded += u32::from(stderr(&output).contains("the number of Gaussians stays at"));
            place.model(&out, 40)
        } else {
            assert!(
                stderr(&output).contains(" bytes, ") && stderr(&output).contains("; lower "),
                "{}",
                stderr(&output)
            );
            succeeded(&place.trained(&out, &[&flags[..], &["--resume"]].concat()));
            place.model(&out, 40)
        };
        let is_bounded = stderr(&output).contains("the number of Gaussians stays at");
        assert!(is_bounded || model == expected, "{fault}: another model than with memory; {}", stderr(&output));
    }
    println!(
        "{tried} allocations of a training were refused: {went_on} times it went on, {bounded} times with a bound"
    );
    assert!(tried > 10 && went_on > bounded && bounded > 0 && tried > went_on, "{tried}, {went_on}, {bounded}");
}

/// After one NaN in device memory, the training returns to a checkpoint and ends in the same bits as without it.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_nan_is_found_and_undone() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings()];
    succeeded(&place.trained("right", &flags));
    let said = succeeded(&place.trained_with(Some("nan:27:NUMBER"), "healed", &flags));
    assert!(
        said.contains("1 Gaussians with positions, opacities or scales that are not finite, the first is 0")
            && said.contains("cull")
            && said.contains("view ")
            && said.contains("training restarts from"),
        "{said}"
    );
    assert!(place.model("healed", 40) == place.model("right", 40), "healed, the model is the same");
    // A repeated NaN halves the learning rates, once.
    let said = succeeded(&place.trained_with(Some("nan:27:NUMBER:2"), "slower", &flags));
    assert!(said.contains("all learning rates are halved"), "{said}");
    assert!(place.model("slower", 40) != place.model("right", 40));
    let rates =
        labelgs::train::state::TrainState::read(&place.checkpoints("slower")[0].path).expect("a checkpoint").config;
    assert_eq!(rates.feature_lr, 0.00125, "a resumed run goes on with them");
    let output = place.trained_with(Some("nan:27:NUMBER:1000"), "broken", &flags);
    assert_eq!(output.status.code(), Some(8), "{}", stderr(&output));
    all_whole(&place.path("broken"));
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
    let lock = labelgs::files::run_folder::Lock::take(&place.path("out")).expect("the first run");
    let output = place.trained("out", &["--iterations", "1"]);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("another labelgs process trains into this folder"), "{}", stderr(&output));
    drop(lock);
    succeeded(&place.trained("out", &["--iterations", "1"]));
}

/// In a step of a minute, the first signal waits for the end of the step, the second ends the program at once.
#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn two_signals_end_a_slow_step_at_once() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let send = |child: &Child| {
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
    };
    let long = ["--iterations", "5000", "--checkpoint-every", "0", "--set", "save_at=3", "--set", "preview_every=0"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
    command.env("LABELGS_FAULT", "vkQueueSubmit:300:SLOW").args(place.train("twice", &long));
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it runs");
    let mut said = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let is_slow = |line: Result<String, std::io::Error>| line.is_ok_and(|line| line.contains("Slow at vkQueueSubmit"));
    assert!(said.any(is_slow), "the slow step comes");
    send(&child);
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().expect("a child").is_none(), "the first signal lets the step come to its end");
    send(&child);
    assert_eq!(child.wait().expect("a child").code(), Some(130));
    all_whole(&place.path("twice"));
    assert!(place.checkpoints("twice").is_empty(), "the second one waits for no checkpoint");
}
