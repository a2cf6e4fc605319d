//! Compilers of cards, without a card: every kernel compiles for each card without spilled registers, and what it
//! compiles to is known. A card that executes nothing, which runs the CPU's side of a training. And the report of a
//! device that the authors do not have. Where the driver is missing, tests say so and return;
//! `LABELGS_REQUIRE_VULKAN=1` requires AMD's.

use assert_cmd::Command;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A card that is not there: name of the driver's file, and the variables that make the driver believe in it.
struct AbsentCard {
    name: &'static str,
    driver: &'static str,
    variables: [(&'static str, &'static str); 2],
}

/// An AMD family. Mesa compiles for it, but it has no memory.
const fn amd(family: &'static str) -> AbsentCard {
    AbsentCard { name: family, driver: "radeon_icd", variables: [("RADV_FORCE_FAMILY", family), ("LD_PRELOAD", "")] }
}

/// An NVIDIA chip, for Mesa's compiler NAK. A library stands in for the kernel driver.
const fn nvidia(name: &'static str, chip: &'static str) -> AbsentCard {
    let variables = [("NOUVEAU_CHIPSET", chip), ("LD_PRELOAD", "libnouveau_noop_drm_shim.so")];
    AbsentCard { name, driver: "nouveau_icd", variables }
}

/// Families that Mesa 22.3 knows: two generations with subgroups of 64 only, two with 32 and 64.
const OLDER_CARDS: [AbsentCard; 4] = [amd("polaris10"), amd("vega20"), amd("navi10"), amd("navi21")];

/// Cards that only newer Mesas compile for. Those of AMD have no table.
const NEWER_CARDS: [AbsentCard; 5] =
    [nvidia("turing", "164"), nvidia("ampere", "174"), amd("navi31"), amd("gfx1200"), amd("gfx1201")];

/// A whole AMD card with 16 GB, whose queues finish at once and do nothing.
const NULL_CARD: AbsentCard = AbsentCard {
    name: "null navi21",
    driver: "radeon_icd",
    variables: [("AMDGPU_GPU_ID", "navi21"), ("LD_PRELOAD", "libamdgpu_noop_drm_shim.so")],
};

const TABLE_FOLDER: &str = "tests/golden/kernels";

/// True if the libraries are here that stand in for kernel drivers, as tools/try-debian has them
/// (`LABELGS_REQUIRE_SHIMS=1` requires them).
fn has_shims() -> bool {
    let folders = fs::read_dir("/usr/lib").into_iter().flatten().flatten();
    let found = folders.into_iter().any(|folder| folder.path().join("libnouveau_noop_drm_shim.so").exists());
    assert!(found || std::env::var("LABELGS_REQUIRE_SHIMS").is_err(), "no package mesa-drm-shim");
    found
}

impl AbsentCard {
    /// Runs the tool on it; `None`, with a message, without its driver.
    fn run(&self, args: &[&str]) -> Option<Output> {
        let folder = Path::new("/usr/share/vulkan/icd.d");
        let is_driver =
            |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(self.driver));
        let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let Some(driver) = files.into_iter().find(is_driver) else {
            let required = std::env::var("LABELGS_REQUIRE_VULKAN").is_ok_and(|value| value == "1");
            // Debian builds these drivers for processors of PCs only.
            assert!(!required || !cfg!(target_arch = "x86_64"), "no {}*.json in {}", self.driver, folder.display());
            eprintln!("skipped: no driver for {}", self.name);
            return None;
        };
        let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
        command.env("VK_DRIVER_FILES", &driver).env("VK_ICD_FILENAMES", driver).envs(self.variables);
        command.env("LABELGS_VALIDATION", "off").env_remove("LABELGS_DEVICE");
        Some(command.args(args).output().expect("it runs"))
    }
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

/// A change of what a kernel compiles to is seen, and explained in `changes.txt`. `LABELGS_NEW_TABLES=WHY` writes new
/// tables instead; `tools/try-debian tables WHY` does so on all Mesas that have one.
#[test]
fn kernels_compile_for_cards_as_the_tables_say() {
    let folder = Path::new(TABLE_FOLDER);
    let why = std::env::var("LABELGS_NEW_TABLES");
    let mut differences = String::new();
    for card in if has_shims() { &NEWER_CARDS[..] } else { &OLDER_CARDS } {
        let Some(output) = card.run(&["kernels"]) else { return };
        // The status is 1 if a kernel spills.
        assert_eq!(output.status.code(), Some(0), "{}: {}", card.name, text(&output.stderr));
        let new = text(&output.stdout);
        for row in new.lines().skip(2) {
            let instructions: f64 = row.split_whitespace().nth(6).and_then(|text| text.parse().ok()).expect("a number");
            assert!(
                instructions > 10.0,
                "{}: with the default constants nothing is left of the kernel: {row}",
                card.name
            );
        }
        println!("{}: {} kernels, none spills", card.name, new.lines().skip(2).count());
        let file = folder.join(card.name).with_extension("txt");
        let Ok(old) = fs::read_to_string(&file) else { continue };
        let compiler = |table: &str| table.lines().next().unwrap_or_default().to_owned();
        if why.is_ok() {
            fs::write(&file, &new).expect("a table");
        } else if compiler(&old) != compiler(&new) {
            eprintln!("not compared: the table is of {}, this is {}", compiler(&old), compiler(&new));
        } else if old != new {
            let _ = write!(differences, "{}:\n{}", card.name, difference(&old, &new));
        }
    }
    assert!(
        differences.is_empty(),
        "kernels compile to something else. If that is meant: tools/try-debian tables WHY\n{differences}"
    );
    let mut tables = crc32fast::Hasher::new();
    for name in OLDER_CARDS.iter().chain(&NEWER_CARDS).map(|card| card.name) {
        tables.update(&fs::read(folder.join(name).with_extension("txt")).unwrap_or_default());
    }
    let hash = format!("{:08x}", tables.finalize());
    let file = folder.join("changes.txt");
    let mut changes = fs::read_to_string(&file).expect("changes.txt");
    if let Ok(why) = why {
        // A reason that is given on two Mesas is one line.
        changes.truncate(changes.trim_end().strip_suffix(&why).map_or(changes.len(), |rest| rest.trim_end().len() - 8));
        changes += &format!("{hash} {why}\n");
        fs::write(&file, &changes).expect("changes.txt");
    }
    let why = changes.lines().last().unwrap_or_default().strip_prefix(&hash).unwrap_or_default().trim();
    assert!(
        why.len() > 20,
        "the last line of {TABLE_FOLDER}/changes.txt must begin with {hash} and say why the tables changed"
    );
}

/// The CPU's side of a training on a card, with the card's list of passes: nothing executes, so the model that comes
/// back is none.
#[test]
fn a_card_that_executes_nothing_runs_every_step_and_is_found_out() {
    if !has_shims() {
        eprintln!("skipped: no card that executes nothing");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (scene, masks, out) = (path("scene"), path("scene/masks"), path("out"));
    let run = |args: &[&str]| NULL_CARD.run(args).expect("a driver");
    let json = |output: Output| -> serde_json::Value {
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let made = run(&["synth", &scene, "--preset", "simple", "--size", "320x240", "--views", "12"]);
    assert!(made.status.success(), "{}", text(&made.stderr));

    let found = &json(run(&["devices", "--json"]))["devices"][0];
    let bytes = |name: &str| found[name].as_u64().expect("a number");
    assert!(found["kind"] == "discrete" && bytes("memory_bytes") > 8 << 30, "{found}");
    assert!(bytes("usable_memory_bytes") > bytes("memory_bytes") / 2, "{found}");

    let profile = json(run(&["profile", &scene, "--masks", &masks, "--steps", "50", "--json"]));
    let passes: Vec<_> =
        profile["passes"].as_array().expect("passes").iter().map(|pass| pass["name"].clone()).collect();
    for name in ["project_visible_labels_lazy_sweep", "group_forward_labels", "group_backward_labels", "update_labels"]
    {
        assert!(passes.contains(&name.into()), "{name} is not among {passes:?}");
    }
    let sent = profile["bytes_to_device"].as_f64().expect("bytes");
    let cpu = profile["processor_ms"].as_f64().expect("ms");
    // A card steps through 133,000 Gaussians in some 0.7 ms.
    assert!(cpu < 2.0, "{cpu} ms of CPU time a step would hold up a card");
    // A photo has 307,200 bytes.
    assert!(sent < 50_000.0, "{sent} bytes a step go to a card on which the photos stay");
    println!(
        "null card: {:.2} ms of the CPU and {:.2} ms by the clock a step, {sent:.0} bytes to the card",
        cpu,
        profile["pipeline_ms"]["mean"].as_f64().expect("ms")
    );

    // Without what would drop Gaussians that no pixel shows; photos become larger on the way.
    let settings = ["densify_from=1000", "densify_until=1000", "prune_share=0", "full_size_from=20"];
    let settings = settings.iter().flat_map(|setting| ["--set", setting]);
    let train = ["train", &scene, "--masks", &masks, "--iterations", "40", "-o", &out];
    let trained = run(&train.into_iter().chain(settings).collect::<Vec<_>>());
    assert_eq!(trained.status.code(), Some(8), "{}", text(&trained.stderr));
    assert!(text(&trained.stderr).contains("numerical failure at step 40"), "{}", text(&trained.stderr));
    let tested = run(&["selftest"]);
    assert!(!tested.status.success() && text(&tested.stderr).contains("a pass wrote"), "{}", text(&tested.stderr));
}

/// A driver without hardware has no memory: commands that compute are refused before they touch it.
#[test]
fn a_card_that_only_compiles_runs_nothing() {
    let card = amd("navi21");
    for args in [&["selftest"][..], &["profile", "--synthetic", "--steps", "1"]] {
        let Some(output) = card.run(args) else { return };
        assert_eq!(output.status.code(), Some(4), "{args:?}: {:?} {}", output.status, text(&output.stderr));
        let said = text(&output.stderr);
        assert!(said.contains("lacks memory (needed 64 MiB, found 0 MiB)"), "{args:?}: {said}");
    }
    // A report tells the authors why.
    let file = tempfile::NamedTempFile::new().expect("a file");
    let path = file.path().to_str().expect("UTF-8");
    assert_eq!(card.run(&["selftest", "--report", path]).expect("a driver").status.code(), Some(4));
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
