//! Scripts of `tools`: help, and arguments that none of them has.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Scripts of a folder of `tools` that are called by hand.
fn scripts(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools").join(folder);
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let is_script = |path: &PathBuf| {
        let text = std::fs::read(path).unwrap_or_default();
        // `sbatch` is given its jobs, and cargo calls `fuzz/rustc`.
        let by_others = path.ends_with("fuzz/rustc") || path.extension().is_some_and(|extension| extension == "sbatch");
        text.starts_with(b"#!/usr/bin/env bash") && !by_others
    };
    entries.filter(|path| path.is_file()).filter(is_script).collect()
}

fn run(script: &Path, argument: &str, folder: &Path) -> Output {
    Command::new("bash").arg(script).arg(argument).current_dir(folder).output().expect("bash runs")
}

#[test]
fn help_is_printed_and_makes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let all: Vec<PathBuf> = ["", "bench", "fuzz", "formats", "workflow"].into_iter().flat_map(scripts).collect();
    // The benchmarks list themselves, which needs them built.
    let all: Vec<PathBuf> = all.into_iter().filter(|script| !script.ends_with("bench/run")).collect();
    assert!(all.len() > 15, "{all:?}");
    for script in all {
        let output = run(&script, "--help", folder.path());
        let (told, name) =
            (String::from_utf8_lossy(&output.stdout), script.file_name().expect("a name").to_string_lossy());
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(told.contains(&format!("{name}")) && !told.contains("set -euo"), "{name}: {told}");
        assert!(told.lines().count() > 2 && told.starts_with(|c: char| c.is_uppercase()), "{name}: {told}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0, "help makes nothing");
}

#[test]
fn an_unknown_argument_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let tools = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools");
    for (name, argument) in [("demo", "--steps"), ("package", "now"), ("pictures", "--out"), ("same-bits", "--all")] {
        let output = run(&tools.join(name), argument, folder.path());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {told}");
        assert!(told.starts_with(&format!("{name}: ")) && told.contains("--help"), "{told}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}
