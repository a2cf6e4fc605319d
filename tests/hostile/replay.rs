//! Replays the findings of fuzzing and its seeds through every reader.

use super::targets::{ALL_TARGETS, TargetFolder, find};
use std::fs;
use std::path::Path;

/// Every seed is a valid file, so fuzzing starts from accepted input.
#[test]
fn seeds_are_accepted() {
    for target in &ALL_TARGETS {
        let place = TargetFolder::new(target);
        let seeds = (target.seeds)();
        assert!(!seeds.is_empty(), "{} has no seed", target.name);
        for (index, seed) in seeds.iter().enumerate() {
            place.put(seed);
            let answer = place.read();
            // A checkpoint of the seeds is whole, and of no training.
            let odd = target.name.starts_with("checkpoint");
            match answer {
                Err(error) if odd => assert!(error.to_string().contains("contents"), "{error}"),
                Err(error) => panic!("{}, seed {index}: {error}", target.name),
                Ok(()) => assert!(!odd, "{}, seed {index}: a checkpoint of nothing was accepted", target.name),
            }
        }
    }
}

#[test]
fn findings_stay_fixed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/fuzz/regressions");
    let mut replayed = 0;
    for folder in fs::read_dir(&root).expect("the folder of findings").map(|entry| entry.expect("a folder").path()) {
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        let place = TargetFolder::new(find(&name).unwrap_or_else(|| panic!("{name} is no target")));
        for file in fs::read_dir(&folder).expect("findings").map(|entry| entry.expect("a file").path()) {
            place.check(&fs::read(&file).expect("a finding"));
            replayed += 1;
        }
    }
    println!("{replayed} findings of fuzzing replayed");
    assert!(replayed > 0, "no finding was there");
}
