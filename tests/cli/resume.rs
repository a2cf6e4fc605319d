//! `labelgs train` is stopped, killed or out of disk space, and resumed with `--resume`.

use crate::support::device;
use crate::support::runs::{Place, all_whole, files, kills, stderr, succeeded};
use labelgs::files::run_folder::Lock;
use labelgs::train::state::TrainState;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::BTreeSet;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Number of kills.
const KILL_COUNT: u32 = 6;
/// Steps of a run.
const STEP_COUNT: u32 = 40;

fn wait_until(child: &mut Child, what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() && child.try_wait().expect("a child").is_none() {
        assert!(start.elapsed() < Duration::from_secs(60), "nothing happens");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn kills_at_any_moment_cost_no_bit() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("first", &["--config", &place.settings()]));
    let start = Instant::now();
    succeeded(&place.trained("straight", &["--config", &place.settings()]));
    let run = start.elapsed();
    assert_eq!(place.checkpoints("straight").len(), 1, "a run that has ended leaves its last one");
    let kinds: Vec<String> = place.history("straight").iter().map(|line| line["kind"].to_string()).collect();
    let count = |kind: &str| kinds.iter().filter(|found| found.trim_matches('"') == kind).count();
    assert_eq!((count("steps"), count("preview"), count("scores")), (4, 6, 1), "{kinds:?}");
    assert!(count("densified") > 0, "{kinds:?}");
    let kills = kills(KILL_COUNT);
    let mut random = Pcg32::seed_from_u64(u64::from(kills));
    let newest = || place.checkpoints("out").first().map_or((0, 0), |found| (found.number, found.step));
    // Steps of the checkpoints after each kill.
    let (mut killed, mut steps, mut ended, mut began) = (0, Vec::new(), 0, 0);
    while killed < kills || !steps.is_empty() {
        let (before, step) = newest();
        let mut child = place.spawned(&place.train("out", &["--config", &place.settings(), "--resume"]));
        if killed < kills {
            // Every second kill comes at any moment, the others during or after a write.
            if killed % 2 == 0 {
                wait_until(&mut child, || newest().0 > before);
                std::thread::sleep(Duration::from_micros(random.random_range(0..40_000)));
            } else {
                std::thread::sleep(run.mul_f64(random.random_range(0.0..1.0)));
            }
            child.kill().expect("killed or done");
        }
        let status = child.wait().expect("a child");
        all_whole(&place.path("out"));
        assert!(newest().1 >= step, "a checkpoint is gone: {step} and {:?}", newest());
        if status.signal().is_some() {
            (killed, began) = (killed + 1, began + u32::from(newest().1 > 0));
            steps.push(newest().1);
            continue;
        }
        // The run ended before the kill.
        assert!(status.success(), "{status}");
        assert!(
            place.model("out", STEP_COUNT) == place.model("straight", STEP_COUNT),
            "killed after {steps:?}: the models differ"
        );
        assert_eq!(place.history("out"), place.history("straight"), "killed after {steps:?}");
        assert!(files(&place.path("out")).iter().all(|path| path.extension().is_none_or(|name| name != "tmp")));
        assert_eq!(place.checkpoints("out").iter().map(|found| found.step).collect::<Vec<_>>(), [STEP_COUNT]);
        std::fs::remove_dir_all(place.path("out")).expect("removed");
        (ended, steps) = (ended + 1, Vec::new());
    }
    println!("{killed} kills, {began} of them after a checkpoint; {ended} trainings came to their end between them");
    assert!(killed == kills && began > 0 && ended > 0);
}

/// A kill while a checkpoint is being written costs the steps since the one before, and no bit; also where the state
/// waits in the device's memory.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_kill_while_a_checkpoint_is_written_costs_no_bit() {
    let Some(_turn) = device() else { return };
    let card = [("LABELGS_PHOTOS", "resident"), ("LABELGS_FRAMES", "4"), ("LABELGS_AHEAD", "yes")];
    let card = || card.map(|(name, value)| (name, value.to_owned())).to_vec();
    let mut models = Vec::new();
    // The writer waits in the second checkpoint: before it reads, before it writes, after it has written.
    for (environment, event, newest) in [(card(), 4, 4), (Vec::new(), 5, 4), (card(), 6, 8)] {
        let place = Place::on(environment);
        let settings = place.settings();
        let flags = ["--config", settings.as_str()];
        let mut child = place.spawned_with(Some(&format!("checkpoint:{event}:SLOW")), &place.train("out", &flags));
        let history = place.path("out/history.jsonl");
        // That is of step 8, and the third one waits for it. The thread may be slower than the steps.
        let goes_on = || std::fs::read_to_string(&history).is_ok_and(|text| text.contains("\"step\":10"));
        let written = || place.checkpoints("out").first().map(|found| found.step);
        wait_until(&mut child, || goes_on() && written() == Some(newest));
        child.kill().expect("it runs");
        child.wait().expect("a child");
        assert_eq!(written(), Some(newest));
        all_whole(&place.path("out"));
        succeeded(&place.trained("out", &["--resume"]));
        models.push(place.model("out", 40));
        succeeded(&place.trained("straight", &flags));
        assert!(models.last() == Some(&place.model("straight", 40)));
        assert_eq!(place.history("out"), place.history("straight"));
    }
    assert!(models.iter().all(|model| *model == models[0]));
}

#[test]
fn leftovers_of_killed_runs_go_from_every_folder() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "4", "--set", "preview_every=2", "--checkpoint-every", "2"]));
    let whole: BTreeSet<PathBuf> = files(&place.path("out")).into_iter().collect();
    let folders: BTreeSet<&Path> = whole.iter().filter_map(|path| path.parent()).collect();
    for folder in &folders {
        // No process has this id.
        std::fs::write(folder.join(".labelgs-4194305-abc.tmp"), "").expect("written");
    }
    succeeded(&place.trained("out", &["--resume"]));
    assert_eq!(files(&place.path("out")).into_iter().collect::<BTreeSet<_>>(), whole, "{folders:?}");
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_a_checkpoint() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let long = ["--iterations", "5000", "--checkpoint-every", "0", "--set", "save_at=3", "--set", "preview_every=0"];
    let send = |child: &Child, signal: &str| {
        let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
    };
    for (signal, status, out) in [("-INT", 130, "int"), ("-TERM", 143, "term")] {
        let mut child = place.spawned(&place.train(out, &long));
        wait_until(&mut child, || place.path(out).join("point_cloud/iteration_3/point_cloud.ply").exists());
        assert!(place.checkpoints(out).is_empty());
        send(&child, signal);
        assert_eq!(child.wait().expect("a child").code(), Some(status));
        let found = place.checkpoints(out);
        let state = TrainState::read(&found[0].path).expect("a whole one");
        assert!(found.len() == 1 && state.step == found[0].step && state.step >= 3);
        assert!(!place.model(out, state.step).is_empty());
    }
    // At any moment: at once before the first step, with a checkpoint after it.
    let mut random = Pcg32::seed_from_u64(5);
    for turn in 0..kills(4) {
        let out = format!("any-{turn}");
        let mut child = place.spawned(&place.train(&out, &long));
        std::thread::sleep(Duration::from_micros(random.random_range(0..1_500_000)));
        send(&child, "-INT");
        let status = child.wait().expect("a child");
        if status.signal().is_some() && !place.path(&out).exists() {
            continue; // before the program had begun
        }
        assert_eq!(status.code(), Some(130), "{out}: {status}");
        all_whole(&place.path(&out));
        let left = place.checkpoints(&out).len();
        assert!(left <= 1 && (left == 1) == place.path(&out).join("metrics.json").exists(), "{out}: {left}");
    }
}

#[test]
fn a_resumed_run_says_what_changed_and_what_cannot() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let nothing = place.trained("out", &["--resume", "--iterations", "6", "--checkpoint-every", "2"]);
    assert!(succeeded(&nothing).contains("no checkpoint; training starts at step 1"), "{}", stderr(&nothing));
    let first = place.model("out", 6);
    let refused = |flags: &[&str], status: i32, parts: &[&str]| {
        let output = place.trained("out", &[&["--resume"], flags].concat());
        assert_eq!(output.status.code(), Some(status), "{flags:?}: {}", stderr(&output));
        let text = stderr(&output);
        assert!(parts.iter().all(|part| text.contains(part)), "{flags:?}: {text}");
    };
    refused(&["--seed", "4"], 2, &["--seed: 0 in the checkpoint, now 4"]);
    refused(&["--set", "sh_degree=1"], 2, &["--set sh_degree: 3 in the checkpoint, now 1"]);
    refused(
        &["--set", "moments=half"],
        2,
        &["--set moments: full in the checkpoint, now half; it cannot change within a run"],
    );
    refused(&["--set", "label_rule=main"], 2, &["--set label_rule"]);
    refused(&["--test-every", "0"], 2, &["--test-every: 8 in the checkpoint, now 0"]);
    refused(&["--iterations", "5"], 2, &["--iterations", "6 steps"]);
    assert_eq!(place.model("out", 6), first);

    // The checkpoint records the folder of the masks.
    let args = ["train", &place.text("scene"), "-o", &place.text("out"), "--resume", "--iterations", "9"];
    let text = succeeded(&place.labelgs(&[&args[..], &["--set", "feature_lr=0.003", "--memory-limit", "2G"]].concat()));
    for part in
        ["--iterations: 6 in the checkpoint, now 9", "--set feature_lr: 0.0025 in", "--memory-limit: not set in"]
    {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert!(!place.model("out", 9).is_empty());
    let text = succeeded(&place.trained("out", &["--resume", "-q"]));
    assert!(!text.contains("now"), "what was changed is in the new checkpoint: {text}");

    // Settings without a near plane or a budget keep those of the checkpoint.
    let decided = || {
        let config = TrainState::read(&place.checkpoints("out")[0].path).expect("a whole one").config;
        (config.near, config.budget)
    };
    let before = decided();
    std::fs::write(place.path("few.toml"), "iterations = 10\n").expect("settings");
    let text = succeeded(&place.trained("out", &["--resume", "--config", &place.text("few.toml")]));
    assert!(before.0 > 0.0 && before.1 > 0 && decided() == before, "{before:?}, {:?}: {text}", decided());
    assert!(!text.contains("--set near") && !text.contains("--budget"), "{text}");

    // Masks that differ from the run's are refused.
    std::fs::rename(place.path("scene/masks"), place.path("masks")).expect("moved");
    refused(&[], 3, &["masks"]);
    let mask = place.path("masks/001.png");
    std::fs::copy(place.path("masks/002.png"), &mask).expect("another mask");
    let moved = ["train", &place.text("scene"), "-o", &place.text("out"), "--resume", "--masks", &place.text("masks")];
    let output = place.labelgs(&moved);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("001.png: has another mask than in"), "{}", stderr(&output));
}

#[test]
fn a_damaged_checkpoint_gives_way_to_the_one_before() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--iterations", "9", "--checkpoint-every", "3", "--set", "save_at=8"];
    succeeded(&place.trained("straight", &flags));
    let mut child = place.spawned(&place.train("out", &flags));
    wait_until(&mut child, || place.checkpoints("out").first().is_some_and(|found| found.step >= 6));
    child.kill().expect("killed");
    child.wait().expect("a child");
    let found = place.checkpoints("out");
    assert!(found.len() >= 2, "{found:?}");
    let whole = std::fs::read(&found[0].path).expect("bytes");
    std::fs::write(&found[0].path, &whole[..whole.len() / 2]).expect("cut");
    let text = succeeded(&place.trained("out", &["--resume"]));
    let name = found[0].path.file_name().expect("a name").to_string_lossy().into_owned();
    assert!(
        text.contains(&name) && text.contains("cut short") && text.contains("trying the previous checkpoint"),
        "{text}"
    );
    assert!(place.model("out", 9) == place.model("straight", 9));
    // Without an intact checkpoint, training refuses to overwrite files that a user may still rescue.
    for found in place.checkpoints("out") {
        std::fs::write(&found.path, b"labelgs").expect("damaged");
    }
    let output = place.trained("out", &["--resume"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

/// Masks without objects: labels are requested, but there is none to learn.
#[test]
fn masks_without_objects_are_resumed_like_others() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    for mask in files(&place.path("scene/masks")).iter().filter(|path| path.extension().is_some_and(|e| e == "png")) {
        image::GrayImage::new(64, 48).save(mask).expect("a mask");
    }
    // Schedules that do not depend on the length of the run.
    let schedule =
        ["--set", "strategy=adc", "--set", "start_size=1", "--set", "rate_final=1", "--set", "sh_degree_interval=9"];
    let flags = [&["--checkpoint-every", "2", "--set", "label_from=2"][..], &schedule].concat();
    succeeded(&place.trained("straight", &[&flags[..], &["--iterations", "8"]].concat()));
    succeeded(&place.trained("out", &[&flags[..], &["--iterations", "4"]].concat()));
    let text = succeeded(&place.trained("out", &["--resume", "--iterations", "8"]));
    assert!(text.contains("resuming after step 4"), "{text}");
    assert!(place.model("out", 8) == place.model("straight", 8));
}

/// The checkpoint records the options that the scene was read with.
#[test]
fn a_resumed_run_reads_the_scene_as_the_first_did() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    std::fs::write(place.path("scene/images/003.png"), b"no photo").expect("written");
    let flags = ["--iterations", "4", "--checkpoint-every", "2"];
    assert_eq!(place.trained("out", &flags).status.code(), Some(3), "a sixth is more than a tenth");
    succeeded(&place.trained("out", &[&flags[..], &["--max-bad-photos", "0.3"]].concat()));
    succeeded(&place.trained("out", &["--resume", "--iterations", "6"]));
    assert!(!place.model("out", 6).is_empty());
}

/// Folders without write permission, and previews that cannot be written during a run.
#[cfg(target_os = "linux")]
#[test]
fn unwritable_folders_are_refused_and_lost_previews_warned_of() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let masks = place.text("scene/masks");
    let output = place.labelgs(&["train", &place.text("scene"), "-o", "/sys/labelgs", "--masks", &masks]);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("/sys/labelgs: cannot be written"), "{}", stderr(&output));
    assert!(!stderr(&output).contains("initial device memory"), "nothing was trained: {}", stderr(&output));
    // A file in the place of the folder of previews.
    std::fs::create_dir_all(place.path("out")).expect("a folder");
    std::fs::write(place.path("out/preview"), b"").expect("a file");
    let output = place.trained("out", &["--iterations", "6", "--set", "preview_every=2", "--checkpoint-every", "2"]);
    let said = stderr(&output);
    assert!(said.matches("training continues without it").count() == 2, "{said}");
    assert_eq!(output.status.code(), Some(7), "that of the end is missing: {said}");
    assert!(!place.model("out", 6).is_empty() && place.checkpoints("out")[0].step == 6);
}

/// A limit on file size (`ulimit -f`) imitates a full disk: the model fits, a checkpoint does not.
#[cfg(target_os = "linux")]
#[test]
fn without_space_the_run_ends_and_the_last_checkpoint_stays() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--iterations", "4", "--checkpoint-every", "2", "--set", "preview_every=0"];
    succeeded(&place.trained("out", &flags));
    let old = place.checkpoints("out");
    let mut args = place.train("out", &["--resume", "--iterations", "8"]);
    // In blocks of 512 bytes. A write beyond the limit returns an error because the signal is ignored.
    let size = std::fs::metadata(&old[0].path).expect("a file").len() / 512 - 1;
    let script = format!("trap '' XFSZ; ulimit -f {size}; exec \"$@\"");
    args.insert(0, env!("CARGO_BIN_EXE_labelgs").to_owned());
    let mut shell = std::process::Command::new("sh");
    shell.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", "off").args(["-c", &script, "sh"]).args(args);
    let output = shell.output().expect("a shell");
    let text = succeeded(&output);
    assert!(text.contains("cannot be written") && text.contains("training continues"), "{text}");
    assert_eq!(place.checkpoints("out"), old, "the last one is there");
    TrainState::read(&old[0].path).expect("and whole");
    assert!(!place.model("out", 8).is_empty());
    assert!(files(&place.path("out")).iter().all(|path| path.extension().is_none_or(|name| name != "tmp")));
    // A file in place of the folder is found before any work.
    std::fs::create_dir_all(place.path("blocked")).expect("a folder");
    std::fs::write(place.path("blocked/checkpoints"), b"").expect("a file");
    let output = place.trained("blocked", &flags);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("checkpoints"), "{}", stderr(&output));
}

#[test]
fn an_output_that_was_deleted_meanwhile_is_made_anew() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--iterations", "30", "--checkpoint-every", "3", "--set", "preview_every=0"];
    let args = place.train("out", &flags);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"));
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache")).args(args);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it runs");
    wait_until(&mut child, || !place.checkpoints("out").is_empty());
    // A checkpoint may be written at the same time.
    while std::fs::remove_dir_all(place.path("out")).is_err() {}
    let text = succeeded(&child.wait_with_output().expect("a child"));
    assert!(text.contains("was deleted; settings"), "{text}");
    assert!(!place.model("out", 30).is_empty() && place.path("out/config.toml").exists());
    assert_eq!(place.checkpoints("out").iter().map(|found| found.step).collect::<Vec<_>>(), [30]);
    all_whole(&place.path("out"));
}

/// A run ends if its folder was deleted and another run has started there. It may leave the checkpoint that it was
/// writing, and nothing else.
#[test]
fn a_deleted_folder_may_be_the_folder_of_another_run() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let args = place.train("out", &["--iterations", "100000", "--checkpoint-every", "5", "--set", "preview_every=0"]);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"));
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache")).args(args);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it runs");
    wait_until(&mut child, || !place.checkpoints("out").is_empty());
    let out = place.path("out");
    let lock = loop {
        // The first run locks the folder again at its next checkpoint, unless the second run is faster.
        if std::fs::remove_dir_all(&out).is_ok()
            && std::fs::create_dir(&out).is_ok()
            && let Ok(lock) = Lock::take(&out)
        {
            break lock;
        }
    };
    let output = child.wait_with_output().expect("a child");
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("another labelgs process trains into this folder"), "{}", stderr(&output));
    let foreign = files(&out).into_iter().filter(|path| !path.ends_with(".labelgs-lock"));
    let foreign: Vec<PathBuf> = foreign.collect();
    assert!(foreign.len() <= 1 && place.checkpoints("out").len() == foreign.len(), "{foreign:?}");
    drop(lock);
}

/// A new run in the folder of an earlier run ends with its own checkpoints only.
#[test]
fn checkpoints_of_an_earlier_run_stay_until_there_are_new_ones() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "9", "--checkpoint-every", "9"]));
    let old = place.checkpoints("out");
    let text = succeeded(&place.trained("out", &["--iterations", "3", "--checkpoint-every", "0"]));
    assert!(text.contains("from an earlier run") && text.contains("Resume that run"), "{text}");
    assert_eq!(place.checkpoints("out"), old);
    let models = || {
        let found = files(&place.path("out/point_cloud")).into_iter();
        found
            .map(|path| path.parent().and_then(|step| step.file_name()?.to_str().map(str::to_owned)))
            .collect::<Vec<_>>()
    };
    assert!(text.contains("iteration_9/point_cloud.ply is from an earlier run"), "{text}");
    assert_eq!(models(), [Some("iteration_3".to_owned())], "what other commands take is of the last run");
    assert!(place.path("out/earlier/point_cloud/iteration_9/point_cloud.ply").exists(), "and nothing is lost");
    succeeded(&place.trained("out", &["--iterations", "5", "--checkpoint-every", "2", "--set", "save_at=2"]));
    assert_eq!(models().len(), 2, "{:?}", models());
    let steps: Vec<u32> = place.checkpoints("out").iter().map(|found| found.step).collect();
    assert_eq!(steps, [5], "no checkpoint of the run of 9 steps remains");
    assert!(succeeded(&place.trained("out", &["--resume"])).contains("resuming after step 5"));
}
