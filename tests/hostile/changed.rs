//! Valid files of every kind, changed in one place: each is read, or refused with a reason, in bounded memory.
//!
//! Each seed is cut at many lengths, changed at many bytes in four ways, and given hostile numbers at many places:
//! as bytes of every width, and where it is text in place of every number.

use super::targets::{ALL_TARGETS, Target, TargetFolder};
use crate::support::memory::peak_of;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

/// Most places of a seed that are changed; longer seeds are changed at evenly spaced places. `LABELGS_TEST_PLACES` has
/// another number.
static FOLDER_COUNT: LazyLock<usize> =
    LazyLock::new(|| std::env::var("LABELGS_TEST_PLACES").ok().and_then(|places| places.parse().ok()).unwrap_or(12));

/// Numbers that a field may be given, as text.
const HOSTILE_WORDS: [&str; 11] = [
    "0",
    "-1",
    "2147483648",
    "1152921504606846976",
    "18446744073709551615",
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "1e999",
    "-1e-320",
];

/// The same as bytes of integers and floats, in both byte orders.
fn numbers() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    let mut both = |little: &[u8]| {
        all.push(little.to_vec());
        all.push(little.iter().rev().copied().collect());
    };
    [0, u64::MAX, 1 << 31, 1 << 60].iter().for_each(|value: &u64| both(&value.to_le_bytes()));
    [0, u32::MAX, 1 << 31, 1 << 24].iter().for_each(|value: &u32| both(&value.to_le_bytes()));
    [0, u16::MAX].iter().for_each(|value: &u16| both(&value.to_le_bytes()));
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308].iter().for_each(|value| both(&value.to_le_bytes()));
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].iter().for_each(|value| both(&value.to_le_bytes()));
    all.sort();
    all.dedup();
    all
}

/// Up to [`FOLDER_COUNT`] places below `length`.
fn places(length: usize) -> impl Iterator<Item = usize> {
    (0..length).step_by(length.div_ceil(*FOLDER_COUNT).max(1))
}

/// Every change of a file.
fn changes(seed: &[u8], visit: &mut impl FnMut(Vec<u8>)) {
    places(seed.len()).for_each(|length| visit(seed[..length].to_vec()));
    let mut changed = |at: usize, with: &[u8]| {
        let mut bytes = seed.to_vec();
        let end = (at + with.len()).min(bytes.len());
        bytes[at..end].copy_from_slice(&with[..end - at]);
        visit(bytes);
    };
    let numbers = numbers();
    for at in places(seed.len()) {
        [0, 0xff, seed[at] ^ 1 << (at % 8), seed[at].wrapping_add(1)].iter().for_each(|&byte| changed(at, &[byte]));
        numbers.iter().for_each(|number| changed(at, number));
    }
    for (start, end) in words(seed) {
        for word in HOSTILE_WORDS {
            visit([&seed[..start], word.as_bytes(), &seed[end..]].concat());
        }
    }
    visit([seed, seed].concat());
    visit(seed.iter().flat_map(|&byte| if byte == b'\n' { vec![b'\r', b'\n'] } else { vec![byte] }).collect());
}

/// Where the numbers of a text are.
fn words(text: &[u8]) -> Vec<(usize, usize)> {
    let part = |byte: &u8| byte.is_ascii_digit() || b".-+e".contains(byte);
    let mut found = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let length = text[at..].iter().take_while(|byte| part(byte)).count();
        if text[at..at + length].iter().any(u8::is_ascii_digit) {
            found.push((at, at + length));
        }
        at += length.max(1);
    }
    let step = found.len().div_ceil(*FOLDER_COUNT / 4).max(1);
    found.into_iter().step_by(step).collect()
}

/// Runs all changes of the seeds of a target; returns how many there were, how many were accepted, and the most bytes.
fn run(target: &'static Target) -> (usize, usize, usize) {
    let place = TargetFolder::new(target);
    let (mut cases, mut accepted, mut most) = (0, 0, 0);
    for (index, seed) in (target.seeds)().iter().enumerate() {
        changes(seed, &mut |bytes| {
            place.put(&bytes);
            let read = || catch_unwind(AssertUnwindSafe(|| place.judge(place.read())));
            let (answer, peak) = peak_of(read);
            let keep = || {
                let path = std::env::temp_dir().join(format!("labelgs-{}-{index}-{cases}", target.name));
                std::fs::write(&path, &bytes).expect("the failing file");
                path.display().to_string()
            };
            match answer {
                Ok(fine) => accepted += usize::from(fine),
                Err(_) => panic!("{}: panics on a changed seed {index}, kept as {}", target.name, keep()),
            }
            let bound = place.memory_bound(bytes.len());
            assert!(peak <= bound, "{}: {peak} bytes for {} of {}", target.name, bytes.len(), keep());
            most = most.max(peak);
            cases += 1;
        });
    }
    (cases, accepted, most)
}

/// Targets whose name starts so. One thread reads, so that all of its memory is counted.
fn run_all(prefixes: &[&str]) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let start = std::time::Instant::now();
    let mut total = 0;
    for target in ALL_TARGETS.iter().filter(|target| prefixes.iter().any(|prefix| target.name.starts_with(prefix))) {
        let (cases, accepted, most) = pool.install(|| run(target));
        println!("{}: {cases} cases, {accepted} accepted, at most {} KiB", target.name, most >> 10);
        assert!(cases > 100, "{}: only {cases} cases", target.name);
        assert!(accepted < cases, "{}: everything was accepted", target.name);
        total += cases;
    }
    println!("{prefixes:?}: {total} cases in {:.1} s", start.elapsed().as_secs_f64());
}

#[test]
fn changed_colmap_models_are_read_or_refused() {
    run_all(&["colmap_"]);
}

#[test]
fn changed_text_files_are_read_or_refused() {
    run_all(&[
        "transforms_",
        "poses_",
        "metashape_",
        "config_",
        "camera_",
        "labels_",
        "occlusion_",
        "frames_",
        "pred_",
        "profile_",
    ]);
}

#[test]
fn changed_plys_are_read_or_refused() {
    run_all(&["ply_"]);
}

#[test]
fn changed_models_are_read_or_refused() {
    run_all(&["spz_", "glb", "sog", "splat", "usd_"]);
}

#[test]
fn changed_masks_are_read_or_refused() {
    run_all(&["mask"]);
}

#[test]
fn changed_depth_maps_are_read_or_refused() {
    run_all(&["depth_"]);
}

#[test]
fn changed_photos_are_read_or_refused() {
    run_all(&["photo_"]);
}

#[test]
fn changed_weights_are_read_or_refused() {
    run_all(&["lpips_"]);
}

#[test]
fn changed_checkpoints_are_read_or_refused() {
    run_all(&["checkpoint"]);
}
