//! Mesa's compiler for AMD cards, without a card: every kernel compiles for each family without spilled registers, and
//! what it compiles to is known. And the report of a device that the authors do not have. Where the driver is missing,
//! tests say so and return; `LABELGS_REQUIRE_VULKAN=1` requires it.

use assert_cmd::Command;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Families that Mesa 22.3 knows: two generations with subgroups of 64 only, two with 32 and 64.
const GPU_FAMILIES: [&str; 4] = ["polaris10", "vega20", "navi10", "navi21"];

const TABLE_FOLDER: &str = "tests/golden/kernels";

/// The driver's file, or `None` with a message.
fn driver() -> Option<PathBuf> {
    let folder = Path::new("/usr/share/vulkan/icd.d");
    let is_radeon =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("radeon_icd"));
    let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let found = files.into_iter().find(is_radeon);
    if found.is_none() {
        let required = std::env::var("LABELGS_REQUIRE_VULKAN").is_ok_and(|value| value == "1");
        // Debian builds this driver for processors of PCs only.
        assert!(!required || !cfg!(target_arch = "x86_64"), "no radeon_icd*.json in {}", folder.display());
        eprintln!("skipped: no driver for AMD cards");
    }
    found
}

/// Runs the tool on a card of the family that is not there.
fn on(driver: &Path, family: &str, args: &[&str]) -> Output {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("RADV_FORCE_FAMILY", family).env("VK_DRIVER_FILES", driver).env("VK_ICD_FILENAMES", driver);
    command.env("LABELGS_VALIDATION", "off").env_remove("LABELGS_DEVICE");
    command.args(args).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Rows that are in one table only, the old ones with `-`, the new ones with `+`.
fn difference(old: &str, new: &str) -> String {
    let only = |of: &str, other: &str, sign: char| {
        let rows: Vec<&str> = other.lines().collect();
        of.lines().filter(|row| !rows.contains(row)).fold(String::new(), |mut text, row| {
            let _ = writeln!(text, "{sign} {row}");
            text
        })
    };
    only(old, new, '-') + &only(new, old, '+')
}

/// A change of what a kernel compiles to is seen, and explained in `changes.txt`.
#[test]
fn kernels_compile_for_cards_as_the_tables_say() {
    let Some(driver) = driver() else { return };
    let mut tables = crc32fast::Hasher::new();
    let mut differences = String::new();
    let out = Path::new("target/kernels");
    fs::create_dir_all(out).expect("a folder");
    for family in GPU_FAMILIES {
        let output = on(&driver, family, &["kernels"]);
        // The status is 1 if a kernel spills.
        assert_eq!(output.status.code(), Some(0), "{family}: {}", text(&output.stderr));
        let (new, file) = (text(&output.stdout), format!("{family}.txt"));
        let old = fs::read_to_string(Path::new(TABLE_FOLDER).join(&file)).unwrap_or_default();
        let compiler = |table: &str| table.lines().next().unwrap_or_default().to_owned();
        if !old.is_empty() && compiler(&old) != compiler(&new) {
            eprintln!("not compared: the tables are of {}, this is {}", compiler(&old), compiler(&new));
            return;
        }
        for row in new.lines().skip(2) {
            let instructions: f64 = row.split_whitespace().nth(6).and_then(|text| text.parse().ok()).expect("a number");
            assert!(instructions > 10.0, "{family}: with the default constants nothing is left of the kernel: {row}");
        }
        fs::write(out.join(&file), &new).expect("a table");
        tables.update(new.as_bytes());
        if old != new {
            let _ = write!(differences, "{family}:\n{}", difference(&old, &new));
        }
    }
    let hash = format!("{:08x}", tables.finalize());
    assert!(
        differences.is_empty(),
        "kernels compile to something else. If that is meant: cp target/kernels/*.txt {TABLE_FOLDER}, and add a line to \
         {TABLE_FOLDER}/changes.txt: {hash} and why.\n{differences}"
    );
    let changes = fs::read_to_string(Path::new(TABLE_FOLDER).join("changes.txt")).expect("changes.txt");
    let why = changes.lines().last().unwrap_or_default().strip_prefix(&hash).unwrap_or_default().trim();
    assert!(
        why.len() > 20,
        "the last line of {TABLE_FOLDER}/changes.txt must begin with {hash} and say why the tables changed"
    );
}

/// A driver without hardware has no memory: commands that compute are refused before they touch it.
#[test]
fn a_card_that_only_compiles_runs_nothing() {
    let Some(driver) = driver() else { return };
    for args in [&["selftest"][..], &["profile", "--synthetic", "--steps", "1"]] {
        let output = on(&driver, "navi21", args);
        assert_eq!(output.status.code(), Some(4), "{args:?}: {:?} {}", output.status, text(&output.stderr));
        let said = text(&output.stderr);
        assert!(said.contains("lacks memory (needed 64 MiB, found 0 MiB)"), "{args:?}: {said}");
    }
    // A report tells the authors why.
    let file = tempfile::NamedTempFile::new().expect("a file");
    let path = file.path().to_str().expect("UTF-8");
    assert_eq!(on(&driver, "navi21", &["selftest", "--report", path]).status.code(), Some(4));
    let report: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).expect("a report")).expect("JSON");
    let error = report["error"].as_str().unwrap_or_default();
    assert!(error.contains("lacks memory") && report["checks"] == serde_json::json!([]), "{report}");
    let needs = report["devices"][0]["needs"].as_array().expect("a list");
    let missing: Vec<_> = needs.iter().filter(|need| need["required"] == true && need["met"] == false).collect();
    assert!(missing.len() == 1 && missing[0]["what"] == "memory", "{missing:?}");
}

/// A report has what the authors ask for, and nothing that tells whose machine it is.
#[test]
fn a_report_says_nothing_private() {
    let Some(turn) = crate::support::device() else { return };
    let uuid = turn.capabilities().uuid_text();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("of-somebody.json");
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.args(["selftest", "--report"]).arg(&path).assert().success();
    let text = fs::read_to_string(&path).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let checks = report["checks"].as_array().expect("checks");
    assert!(checks.len() == 44 && checks.iter().all(|check| check["passed"] == true), "{checks:?}");
    assert!(report["steps"]["stages"].as_array().is_some_and(|stages| stages.len() > 8), "{}", report["steps"]);
    let compiler = &report["compiler"];
    assert!(
        compiler.is_array() || compiler["error"].as_str().is_some_and(|error| error.contains("lacks")),
        "{compiler}"
    );
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let here = std::env::current_dir().expect("a folder").display().to_string();
    let private = [uuid, variable("HOME"), variable("USER"), host.trim().to_owned(), here, "of-somebody".to_owned()];
    for secret in private.iter().filter(|secret| secret.len() > 4) {
        assert!(!text.contains(secret.as_str()), "the report contains {secret}");
    }
}

/// Where a driver tells nothing of its kernels, this is said.
#[test]
fn a_driver_without_statistics_is_named() {
    if !crate::support::device().is_some_and(|turn| turn.is_cpu()) {
        return;
    }
    let output = Command::cargo_bin("labelgs").expect("the tool is built").args(["kernels"]).output();
    let output = output.expect("it runs");
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("lacks VK_KHR_pipeline_executable_properties"), "{}", text(&output.stderr));
}
