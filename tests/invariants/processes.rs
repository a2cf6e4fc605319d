//! Child processes of this test binary with other numbers of threads and another vector width.

use super::training::train;
use crate::support::device;
use labelgs::run::LabelRule;
use labelgs::scheduler::SchedulerOptions;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::Command;

/// Set in the children, which then print the hash.
const CHILD_VARIABLE: &str = "LABELGS_TEST_CHILD";

/// Not a test by itself: child processes of the tests below run it.
#[test]
fn hash_of_a_training() {
    if std::env::var_os(CHILD_VARIABLE).is_none() {
        return;
    }
    let Some(turn) = device() else { return };
    let mut hasher = DefaultHasher::new();
    for rule in [LabelRule::Votes, LabelRule::Main] {
        let outcome = train(&turn, rule, SchedulerOptions::default(), |_| ());
        (outcome.ply, outcome.losses).hash(&mut hasher);
    }
    println!("subgroup {} hash {:016x}", turn.subgroup_size(), hasher.finish());
}

/// Runs tests of this binary with environment variables, requires that they pass, and returns standard output.
fn child(tests: &[&str], environment: &[(&str, &str)]) -> String {
    let mut command = Command::new(std::env::current_exe().expect("this program has a path"));
    command.args(tests).args(["--nocapture", "--test-threads", "1"]).env(CHILD_VARIABLE, "1");
    command.envs(environment.iter().copied());
    let output = command.output().expect("this program runs again");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{environment:?}: {text}{errors}");
    text
}

/// The hash that a child printed.
fn hash_in(text: &str) -> String {
    let hash = text.split("hash ").nth(1).and_then(|rest| rest.split_whitespace().next());
    hash.unwrap_or_else(|| panic!("no hash in {text}")).to_owned()
}

/// Whether the device is lavapipe, which reads these variables.
fn is_lavapipe() -> bool {
    device().is_some_and(|turn| turn.is_cpu())
}

#[test]
fn a_training_is_the_same_on_any_number_of_threads() {
    if std::env::var_os(CHILD_VARIABLE).is_some() || !is_lavapipe() {
        return;
    }
    let run = |threads: &str| {
        let tests = ["invariants::processes::hash_of_a_training", "--exact"];
        hash_in(&child(&tests, &[("LP_NUM_THREADS", threads)]))
    };
    let one = run("1");
    for threads in ["2", "16"] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
}

/// Without an optional feature the bits are the same, because texel and storage reads return the same numbers. Without
/// pinned subgroups they are those of emulated ones.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn without_optional_features_a_training_is_the_same() {
    if std::env::var_os(CHILD_VARIABLE).is_some() || !is_lavapipe() {
        return;
    }
    let hash = ["invariants::processes::hash_of_a_training"];
    let run = |environment: &[(&str, &str)]| hash_in(&child(&hash, environment));
    let all = hash_in(&child(&hash, &[]));
    for (name, value) in [
        ("LABELGS_HIDE", "timestamps,memory_model,robust"),
        ("LABELGS_LIMIT_TEXELS", "64K"),
        ("LABELGS_LIMIT_BUFFERS", "4"),
    ] {
        assert_eq!(run(&[(name, value)]), all, "with {name}={value}");
    }
    // Emulated subgroups add in another order than lavapipe's.
    let emulated = run(&[("LABELGS_EMULATE", "1")]);
    assert_ne!(emulated, all, "nothing is emulated");
    let unpinned = hash_in(&child(&hash, &[("LABELGS_HIDE", "size_control,full_subgroups")]));
    assert_eq!(unpinned, emulated, "without a pinned subgroup size");
}

/// Tests of `pass` that choose the size of subgroups themselves, which no vector width changes.
const OTHER_SIZES: [&str; 6] = ["--skip", "emulated_subgroups", "--skip", "pass::sweeps", "--skip", "pass::walks"];

/// Subgroups of 16 where the processor has vectors for them (elsewhere the same size again).
#[test]
fn passes_agree_with_their_mirrors_on_wide_vectors() {
    if std::env::var_os(CHILD_VARIABLE).is_some() || !is_lavapipe() {
        return;
    }
    let text = child(
        &[&["pass::", "invariants::processes::hash_of_a_training"][..], &OTHER_SIZES].concat(),
        // Mesa 25 does not tell vector widths apart in its cache on disk.
        &[("LP_NATIVE_VECTOR_WIDTH", "512"), ("MESA_SHADER_CACHE_DISABLE", "true")],
    );
    assert!(text.contains("subgroup 16 hash"), "no subgroups of 16: {text}");
}
