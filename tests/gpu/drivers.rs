//! Drivers other than the one of the test process: SwiftShader, a software Vulkan that shares no code with Mesa, and
//! lavapipe with vectors of 128 bits, as on ARM. Both have subgroups of 4, so subgroups are emulated. And lavapipe that
//! counts as a GPU.

use crate::reference::Rules;
use crate::support::device::{Turn, device, options};
use crate::support::runs::{Place, files, kills, succeeded};
use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::pass::{GroupBlend, KernelShape};
use labelgs::verify::selftest;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::time::Instant;

/// Environment variables that choose a driver.
type Driver = Vec<(&'static str, String)>;

/// SwiftShader, whose driver file `LABELGS_SWIFTSHADER` names (tools/test fetches it), or `None` with a message.
fn swiftshader() -> Option<Driver> {
    match std::env::var("LABELGS_SWIFTSHADER") {
        Ok(file) if file != "none" => Some(vec![("VK_DRIVER_FILES", file.clone()), ("VK_ICD_FILENAMES", file)]),
        _ => {
            let required = std::env::var("LABELGS_REQUIRE_SWIFTSHADER").is_ok_and(|value| value == "1");
            assert!(!required, "LABELGS_REQUIRE_SWIFTSHADER=1, and LABELGS_SWIFTSHADER names no driver file");
            eprintln!("skipped: no SwiftShader");
            None
        }
    }
}

/// Lavapipe with vectors of 128 bits, if this is lavapipe. Mesa 25 does not tell vector widths apart in its cache on
/// disk, so these have one of their own.
fn narrow_lavapipe() -> Option<Driver> {
    let cache = concat!(env!("CARGO_TARGET_TMPDIR"), "/narrow-lavapipe");
    let narrow = || vec![("LP_NATIVE_VECTOR_WIDTH", "128".into()), ("MESA_SHADER_CACHE_DIR", cache.into())];
    device().is_some_and(|turn| turn.is_cpu()).then(narrow)
}

/// The usual driver with the kernels, staging and steps in flight of a GPU. Mesa 22.3 sometimes crashes if kernels
/// compile beside the steps.
#[cfg(feature = "lab")]
fn as_gpu() -> Option<Driver> {
    Some(vec![("LABELGS_HIDE", "cpu".into()), ("LABELGS_AHEAD", "no".into())])
}

#[cfg(not(feature = "lab"))]
fn as_gpu() -> Option<Driver> {
    None
}

fn drivers() -> Vec<Driver> {
    swiftshader().into_iter().chain(as_gpu().or_else(narrow_lavapipe)).collect()
}

#[test]
fn the_selftest_passes_on_other_drivers() {
    // The loss, the walks and the blends of a card on the one that is not Mesa's.
    let for_gpu = [("LABELGS_LOSS", "shared"), ("LABELGS_WALK", "group"), ("LABELGS_BLEND", "group")]
        .map(|(variable, form)| (variable, form.to_owned()));
    let swiftshader = swiftshader().map(|driver| [&driver[..], &for_gpu].concat());
    for driver in swiftshader.into_iter().chain(narrow_lavapipe()) {
        let place = Place::on(driver.clone());
        let said = String::from_utf8_lossy(&succeeded_output(&place.labelgs(&["selftest", "--json"]))).into_owned();
        let found: serde_json::Value = serde_json::from_str(&said).expect("JSON");
        assert_eq!(found["kernels"]["emulated"], true, "{driver:?}: {found}");
        assert_eq!(found["kernels"]["subgroup_size"], 4, "{driver:?}: {found}");
        assert_eq!(found["checks"].as_array().map(Vec::len), Some(44), "{driver:?}: {found}");
    }
}

/// Sorts that look back, as on cards, give the bits of those that do not, on a driver that is not Mesa's either, with
/// keys of 16 bits or without; and walks of workgroups give the same bits again.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn sorts_that_look_back_change_no_bit() {
    for driver in [Vec::new()].into_iter().chain(swiftshader()) {
        let model = |sort: &str, keys: &str| {
            let forms = [("LABELGS_SORT", sort), ("LABELGS_KEYS", keys), ("LABELGS_WALK", "group")];
            let place = Place::on([&driver[..], &forms.map(|(variable, form)| (variable, form.to_owned()))].concat());
            succeeded(&place.trained("out", &["--iterations", "3", "--set", "label_from=1"]));
            place.model("out", 3)
        };
        let lanes = model("lanes", "narrow");
        assert!(model("sweep", "wide") == lanes, "{driver:?}");
        assert!(model("sweep", "narrow") == lanes, "{driver:?}, narrow keys");
    }
}

/// Keys of 16 bits take half the words, unless there are too many tiles, or the device cannot store 16 bits, which is
/// no error.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn keys_are_wide_where_16_bits_do_not_do() {
    let words = |driver: &[(&'static str, String)], layers: &str| {
        let forms =
            [("LABELGS_SORT", "sweep"), ("LABELGS_KEYS", "narrow")].map(|(variable, form)| (variable, form.into()));
        let place = Place::on([driver, &forms].concat());
        let of = ["--gaussians", "101", "--size", "640x480", "--label-samples", layers];
        let plan = succeeded_output(&place.labelgs(&[&["plan"][..], &of, &["--json"]].concat()));
        let plan: serde_json::Value = serde_json::from_slice(&plan).expect("JSON");
        let buffers = plan["memory"]["buffers"].as_array().expect("buffers");
        let keys = buffers.iter().find(|buffer| buffer["name"] == "tile_keys_a").expect("keys");
        (keys["elements"].as_u64(), plan["instances"].as_u64().expect("a number"))
    };
    let hidden = [("LABELGS_HIDE", "narrow_storage".to_owned())];
    let Some(stores) = device().map(|turn| turn.capabilities().has_narrow_storage()) else { return };
    let (keys, pairs) = words(&[], "1");
    assert_eq!(keys, Some(if stores { pairs.div_ceil(2) } else { pairs }));
    for (driver, layers) in [(&hidden[..], "1"), (&[], "200")] {
        let (keys, pairs) = words(driver, layers);
        assert_eq!(keys, Some(pairs), "{driver:?}, {layers} layers");
    }
}

/// Without the promise that plain data reach other workgroups, no list is processed in parts.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn parts_of_lists_need_the_memory_model() {
    let has_parts = |hidden: &str| {
        let place =
            Place::on([("LABELGS_BLEND", "group"), ("LABELGS_HIDE", hidden)].map(|(k, v)| (k, v.into())).into());
        let plan = succeeded_output(&place.labelgs(&["plan", "--gaussians", "2000", "--size", "64x48"]));
        String::from_utf8_lossy(&plan).contains("group_products")
    };
    assert!(device().is_none() || has_parts("timestamps") && !has_parts("memory_model"));
}

fn succeeded_output(output: &std::process::Output) -> Vec<u8> {
    succeeded(output);
    output.stdout.clone()
}

/// A labelled training that is killed and resumed ends in the same bits, and both drivers draw its model alike.
#[test]
fn trainings_survive_kills_on_other_drivers_and_models_look_the_same() {
    // The list takes its turn with the device, and gives it back.
    let drivers = drivers();
    let Some(_turn) = device() else { return };
    for driver in drivers {
        let (place, usual) = (Place::on(driver.clone()), Place::on(Vec::new()));
        let settings = place.settings();
        let flags = ["--config", settings.as_str()];
        let start = Instant::now();
        succeeded(&place.trained("whole", &flags));
        let took = start.elapsed();
        let whole = place.model("whole", 40);
        let mut random = Pcg32::seed_from_u64(4);
        for _ in 0..kills(2) {
            let mut child = place.spawned(&place.train("killed", &flags));
            std::thread::sleep(took.mul_f64(random.random_range(0.2..0.9)));
            child.kill().expect("killed or done");
            let status = child.wait().expect("a child");
            let resumed = if place.checkpoints("killed").is_empty() { vec![] } else { vec!["--resume"] };
            succeeded(&place.trained("killed", &[&flags[..], &resumed].concat()));
            assert!(
                place.model("killed", 40) == whole,
                "{driver:?}: other bits after {status:?} {:?}",
                status.signal()
            );
            std::fs::remove_dir_all(place.path("killed")).expect("removed");
        }
        let scene = place.text("scene");
        let render = |on: &Place, out: &str| {
            let (run, out) = (place.text("whole"), place.text(out));
            let what = ["--what", "rgb,labels", "--format", "exr"];
            let views = ["--scene", scene.as_str(), "--views", "all", "-o", &out];
            succeeded(&on.labelgs(&[&["render", run.as_str()][..], &views, &what].concat()));
        };
        render(&place, "here");
        render(&usual, "there");
        pictures_agree(&place.path("here"), &place.path("there"));
    }
}

/// Pictures that two systems drew of one model: `LABELGS_PICTURES` names their folders, as `here:there`.
/// tools/try-debian draws them on this machine's Mesa and on a newer one.
#[test]
fn pictures_of_two_systems_agree() {
    let Ok(folders) = std::env::var("LABELGS_PICTURES") else {
        eprintln!("skipped: LABELGS_PICTURES names no folders");
        return;
    };
    let (here, there) = folders.split_once(':').expect("LABELGS_PICTURES=here:there");
    pictures_agree(Path::new(here), Path::new(there));
}

/// Compares the pictures of two drivers. Each is within 1e-6 of float64 (src/verify/selftest), so they differ by at
/// most 2e-6, except at pixels where a pair lies so close to the least opacity of 1/255 or to the last transmittance
/// that one driver takes it and the other does not: at most one pixel in a thousand, by at most that opacity. There two
/// weights may also tie for the label.
fn pictures_agree(here: &Path, there: &Path) {
    let (mut pixels, mut flipped, mut labels_differ) = (0, 0, 0);
    for file in files(here) {
        let other = there.join(file.file_name().expect("a name"));
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("exr") => {
                let differences = samples(&file).into_iter().zip(samples(&other)).map(|(a, b)| (a - b).abs());
                for difference in differences {
                    assert!(difference <= 1.0 / 255.0, "{}: {difference}", file.display());
                    (pixels, flipped) = (pixels + 1, flipped + u32::from(difference > 2e-6));
                }
            }
            _ => {
                let open = |path: &Path| image::open(path).expect("a PNG").into_bytes();
                labels_differ += open(&file).iter().zip(open(&other)).filter(|(a, b)| **a != *b).count();
            }
        }
    }
    println!("{pixels} samples, {flipped} beyond 2e-6; {labels_differ} bytes of label maps differ");
    assert!(pixels > 10_000 && flipped * 1000 <= pixels, "{flipped} of {pixels} samples differ by more than 2e-6");
    assert!(labels_differ * 1000 <= pixels as usize, "{labels_differ} bytes of the label maps differ");
}

/// All channels of an EXR.
fn samples(path: &Path) -> Vec<f32> {
    let image = exr::prelude::read_first_flat_layer_from_file(path).expect("an EXR");
    image.layer_data.channel_data.list.iter().flat_map(|channel| channel.sample_data.values_as_f32()).collect()
}

/// Subgroups of each size on this device, through shared memory: no shuffle or scan of 32 or 64 lanes meets them first
/// on a card. The pass list has the tiles and digits of a card of that size. Other drivers have 4; the soak tries all.
#[test]
fn every_subgroup_size_agrees_with_the_mirrors() {
    let all = std::env::var("LABELGS_TEST_SUBGROUPS").is_ok_and(|value| value == "all");
    for size in if all { &[4, 8, 16, 32, 64][..] } else { &[32, 64] }.iter().copied() {
        let options = GpuOptions { subgroup_size: Some(size), emulate_subgroups: true, ..options() };
        let Ok(gpu) = Gpu::new(&options) else { return };
        let turn = Turn::with(gpu);
        let shape = KernelShape { texel: false, ..KernelShape::for_device(turn.capabilities()) };
        // The kernels of a card, but for the smallest size.
        let short = GroupBlend { chunk_length: 32, long_list: 64, ..GroupBlend::DEFAULT };
        let loss_tile = if size > 32 { 8 } else { 16 };
        let narrow_keys = turn.capabilities().has_narrow_storage();
        let shape = if size > 4 {
            KernelShape { loss_tile, narrow_labels: true, narrow_keys, group_walks: true, ..shape }.with_sweeps_of(4)
        } else {
            shape
        };
        let shape = if all || size == 32 { shape.with_group_blend_of(short) } else { shape };
        assert!(shape.emulated && shape.subgroup == size, "{shape:?}");
        let passes = |check: selftest::Check| {
            assert!(check.verdict.is_ok(), "{} at {size}: {:?}", check.name, check.verdict);
        };
        selftest::passes(&Rules::default(), &turn.gpu(), shape, "", passes).expect("the device works");
        selftest::changes(&Rules::default(), &turn.gpu(), shape, passes).expect("the device works");
        // Lavapipe ends the loop of a card over 70,000 splats.
        let shape = KernelShape { group_blend: None, ..shape };
        selftest::wholes(&turn.gpu(), shape, passes).expect("the device works");
    }
}
