//! The fuzzer: one program for all readers; `LABELGS_FUZZ_TARGET` names the one that is fuzzed. See README.md.
#![no_main]

#[path = "../../tests/support/memory.rs"]
mod memory;
mod readers;
mod seeds;
mod targets;

use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;
use targets::Place;

#[global_allocator]
static MEMORY: memory::Counting = memory::Counting;

static PLACE: OnceLock<Place> = OnceLock::new();

/// The folder of the target. With `LABELGS_FUZZ_SEEDS` the target's own seeds are put into that folder first, where
/// libFuzzer finds them a moment later.
fn place() -> &'static Place {
    PLACE.get_or_init(|| {
        let name = std::env::var("LABELGS_FUZZ_TARGET").expect("LABELGS_FUZZ_TARGET names a target");
        let target = targets::find(&name).unwrap_or_else(|| panic!("there is no target {name}: {}", targets::names()));
        if let Some(folder) = std::env::var_os("LABELGS_FUZZ_SEEDS") {
            for (index, seed) in (target.seeds)().into_iter().enumerate() {
                let path = std::path::Path::new(&folder).join(format!("seed-{index:02}"));
                std::fs::write(path, seed).expect("the folder of seeds can be written");
            }
        }
        Place::new(target)
    })
}

fuzz_target!(init: { place(); }, |data: &[u8]| {
    let (_, peak) = memory::peak_of(|| place().check(data));
    let most = place().memory_bound(data.len());
    assert!(peak <= most, "{peak} bytes of memory for a file of {}, {most} are allowed", data.len());
});
