//! Options from the environment, and where findings go.
//!
//! | variable | meaning |
//! | --- | --- |
//! | `LABELGS_CHECKER_LANES` | lanes of a subgroup: 4, 8, 16, 32 or 64; 32 if it is not set |
//! | `LABELGS_CHECKER_TYPE` | `gpu` or `cpu`: the device's type; `gpu` if it is not set |
//! | `LABELGS_CHECKER_SEED` | seed of the schedules; 0 if it is not set |
//! | `LABELGS_CHECKER_LOG` | file to which findings, and kernels that ran, are appended |
//! | `LABELGS_CHECKER_NAMES` | file with a hash and a name in each line, for messages |
//! | `LABELGS_CHECKER_STALE` | if it is 1, reads of unwritten device memory are no findings: a step that fails has them |
//! | `LABELGS_CHECKER_KEEP_GOING` | if it is 1, a finding does not lose the device |

use super::lock;
use crate::findings::{Finding, Kind};
use ash::vk;
use std::collections::{HashMap, HashSet};
use std::io::Write;
use std::sync::{LazyLock, Mutex};

/// What the environment says.
#[derive(Clone, Copy)]
pub(super) struct Options {
    pub(super) lanes: u32,
    pub(super) kind: vk::PhysicalDeviceType,
    pub(super) seed: u64,
    pub(super) keeps_going: bool,
    pub(super) may_be_stale: bool,
}

fn variable(name: &str) -> Option<String> {
    std::env::var(format!("LABELGS_CHECKER_{name}")).ok().filter(|value| !value.is_empty())
}

/// The options of this process.
pub(super) fn options() -> Options {
    static OPTIONS: LazyLock<Options> = LazyLock::new(|| Options {
        lanes: variable("LANES").and_then(|lanes| lanes.parse().ok()).unwrap_or(32),
        kind: match variable("TYPE").as_deref() {
            Some("cpu") => vk::PhysicalDeviceType::CPU,
            _ => vk::PhysicalDeviceType::DISCRETE_GPU,
        },
        seed: variable("SEED").and_then(|seed| seed.parse().ok()).unwrap_or(0),
        may_be_stale: variable("STALE").as_deref() == Some("1"),
        keeps_going: variable("KEEP_GOING").as_deref() == Some("1"),
    });
    *OPTIONS
}

/// Name of a module, or its hash.
fn name(hash: u64) -> String {
    static NAMES: LazyLock<HashMap<String, String>> = LazyLock::new(|| {
        let text = variable("NAMES").and_then(|file| std::fs::read_to_string(file).ok()).unwrap_or_default();
        let pairs = text.lines().filter_map(|line| line.split_once(' '));
        pairs.map(|(hash, name)| (hash.to_owned(), name.to_owned())).collect()
    });
    let hash = format!("{hash:016x}");
    NAMES.get(&hash).cloned().unwrap_or(hash)
}

/// Appends a line to the log.
fn append(line: &str) {
    static FILE: LazyLock<Mutex<Option<std::fs::File>>> = LazyLock::new(|| {
        let file = variable("LOG").map(|path| std::fs::OpenOptions::new().create(true).append(true).open(path));
        Mutex::new(file.map(|file| file.expect("the file of LABELGS_CHECKER_LOG can be written")))
    });
    if let Some(file) = &mut *lock(&FILE) {
        // One write for a line: other processes append too.
        let _ = file.write_all(format!("{line}\n").as_bytes());
    }
}

/// Prints and logs a message about a module.
pub(super) fn say(hash: u64, what: &str) {
    let name = name(hash);
    eprintln!("checker: {name}: {what}");
    append(&format!("finding {name}: {what}"));
}

/// Prints and logs a finding, once for each kind and instruction.
pub(super) fn report(hash: u64, finding: &Finding) {
    static SEEN: LazyLock<Mutex<HashSet<(u64, Kind, u32)>>> = LazyLock::new(Mutex::default);
    if lock(&SEEN).insert((hash, finding.kind, finding.instruction)) {
        say(hash, &finding.text);
    }
}

/// Logs that a module has run, once.
pub(super) fn ran(hash: u64) {
    static SEEN: LazyLock<Mutex<HashSet<u64>>> = LazyLock::new(Mutex::default);
    if lock(&SEEN).insert(hash) {
        append(&format!("ran {hash:016x} {} {}", options().lanes, name(hash)));
    }
}
