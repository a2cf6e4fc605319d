//! The driver of `tests/checker`, which runs invocations one by one: no kernel has a race, a barrier or fence in
//! non-uniform flow, or an access of what is not there.

use crate::reference::Rules;
use crate::support::device::device;
use labelgs::pass::KernelShape;
use labelgs::shaders;
use labelgs::verify::selftest;
use labelgs_checker::program::module_hash;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

/// Where the driver's file and the names of kernels are; `tools/soak` uses them too.
const FOLDER: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/checker");

/// Writes the driver's file, and the names of all kernels for its messages.
static DRIVER: LazyLock<Vec<(&'static str, String)>> = LazyLock::new(|| {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).expect("a folder");
    let library = std::env::current_exe().expect("a path").with_file_name("liblabelgs_checker.so");
    assert!(library.is_file(), "{} is not built", library.display());
    let write = |name: &str, text: String| -> String {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("written");
        path.to_str().expect("UTF-8").to_owned()
    };
    let icd = serde_json::json!({ "library_path": library, "api_version": "1.3.0" });
    let icd = write("icd.json", serde_json::json!({ "file_format_version": "1.0.1", "ICD": icd }).to_string());
    let names = shaders::ALL.iter().fold(String::new(), |mut text, shader| {
        let (words, _) = shader.spirv.as_chunks::<4>();
        let words = words.iter().map(|word| u32::from_le_bytes(*word)).collect::<Vec<_>>();
        let _ = writeln!(text, "{:016x} {}", module_hash(&words), shader.name);
        text
    });
    let names = write("names", names);
    vec![("VK_DRIVER_FILES", icd.clone()), ("VK_ICD_FILENAMES", icd), ("LABELGS_CHECKER_NAMES", names)]
});

/// Runs the test below as a process of its own, on the driver.
fn checked(kind: &str, lanes: &str) {
    let mut command = Command::new(std::env::current_exe().expect("a path"));
    command.args(["--exact", "gpu::checker::on_the_driver", "--ignored", "--nocapture"]).envs(DRIVER.iter().cloned());
    command.env_remove("LABELGS_DEVICE").env("LABELGS_CHECKER_TYPE", kind).env("LABELGS_CHECKER_LANES", lanes);
    let output = command.output().expect("it runs");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success() && said.contains("1 passed"), "{kind}, {lanes} lanes:\n{said}");
}

#[test]
fn kernels_of_a_card_have_no_race() {
    checked("gpu", "32");
}

/// Subgroups of 4 are emulated.
#[test]
fn kernels_of_a_cpu_have_no_race() {
    checked("cpu", "4");
}

#[test]
#[ignore = "run by the tests above, on the driver"]
fn on_the_driver() {
    let turn = device().expect("the driver works");
    let gpu = turn.gpu();
    assert_eq!(gpu.capabilities().name, "labelgs checker");
    let shape = KernelShape::for_device(gpu.capabilities());
    let passes = |check: selftest::Check| assert!(check.verdict.is_ok(), "{}: {:?}", check.name, check.verdict);
    selftest::passes(&Rules::default(), &gpu, shape, "", passes).expect("no finding");
    selftest::changes(&Rules::default(), &gpu, shape, passes).expect("no finding");
}
