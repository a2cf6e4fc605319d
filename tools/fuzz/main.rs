//! The fuzzer: a single program for all readers; `LABELGS_FUZZ_TARGET` names the one to fuzz. See README.md.
#![no_main]

#[path = "../../tests/support/memory.rs"]
mod memory;
mod readers;
mod seeds;
mod targets;

use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;
use targets::TargetFolder;

#[global_allocator]
static MEMORY: memory::Counting = memory::Counting;

static TARGET_FOLDER: OnceLock<TargetFolder> = OnceLock::new();

/// Returns the folder of the target. With `LABELGS_FUZZ_SEEDS`, first writes the target's seeds to that folder, where
/// libFuzzer finds them.
fn place() -> &'static TargetFolder {
    TARGET_FOLDER.get_or_init(|| {
        let name = std::env::var("LABELGS_FUZZ_TARGET").expect("LABELGS_FUZZ_TARGET names a target");
        let target = targets::find(&name).unwrap_or_else(|| panic!("there is no target {name}: {}", targets::names()));
        if let Some(folder) = std::env::var_os("LABELGS_FUZZ_SEEDS") {
            for (index, seed) in (target.seeds)().into_iter().enumerate() {
                let path = std::path::Path::new(&folder).join(format!("seed-{index:02}"));
                std::fs::write(path, seed).expect("the folder of seeds can be written");
            }
        }
        TargetFolder::new(target)
    })
}

fuzz_target!(init: { place(); }, |data: &[u8]| {
    let (_, peak) = memory::peak_of(|| place().check(data));
    let most = place().memory_bound(data.len());
    assert!(peak <= most, "{peak} bytes of memory for a file of {}, {most} are allowed", data.len());
});
