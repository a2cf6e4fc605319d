//! The command line without a device, or with features of the device hidden.

use crate::support::device;
use crate::support::runs::{Place, succeeded};
use assert_cmd::Command;
use serde_json::Value;

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn without_a_driver_devices_fails_and_plan_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let broken = folder.path().join("driver.json");
    let text_of_driver =
        r#"{"file_format_version": "1.0.0", "ICD": {"library_path": "/dev/null", "api_version": "1.3.0"}}"#;
    std::fs::write(&broken, text_of_driver).expect("a file");
    // No driver; a driver with an invalid library; no loader.
    for (driver, fault) in
        [("/nonexistent/driver.json", ""), (broken.to_str().expect("text"), ""), ("", "loader:1:INITIALIZATION")]
    {
        let run = |args: &[&str]| {
            let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
            command.env("LABELGS_FAULT", fault).env_remove("LABELGS_DEVICE").env_remove("LABELGS_VALIDATION");
            if !driver.is_empty() {
                command.env("VK_DRIVER_FILES", driver).env("VK_ICD_FILENAMES", driver);
            }
            command.args(args).output().expect("it runs")
        };
        let output = run(&["devices"]);
        assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("error: no usable Vulkan device: "), "{}", text(&output.stderr));
        let output = run(&["plan", "--gaussians", "1k", "--size", "64x48", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert_eq!(json(&text(&output.stdout))["device"], Value::Null);
        assert_eq!(run(&["plan", "--device", "0"]).status.code(), Some(4));
    }
}

/// A missing feature that the kernels require is named, with status 4.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn required_features_are_missed_by_name() {
    let Some(_gpu) = device() else { return };
    let place = Place::new();
    let scene = place.text("scene");
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("LABELGS_HIDE", "timeline").env("LABELGS_VALIDATION", "off");
    let output = command.args(["profile", &scene, "--steps", "1"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("lacks timelineSemaphore"), "{}", text(&output.stderr));
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let output = command.env("LABELGS_HIDE", "colour").args(["devices"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    // Without timestamps `profile` cannot measure.
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("LABELGS_HIDE", "timestamps").env("LABELGS_VALIDATION", "off");
    let output = command.args(["profile", &scene, "--steps", "1"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("no timestamps"), "{}", text(&output.stderr));
}

/// Where the subgroup size is not certain or shuffles are missing, subgroups are emulated. Debian 12's lavapipe runs
/// others than it reports with vectors of 512 bits, if the size is not pinned.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn subgroups_that_do_not_serve_are_emulated() {
    if !device().is_some_and(|gpu| gpu.is_cpu()) {
        return;
    }
    let place = Place::new();
    for (width, hidden) in
        [("256", "size_control,full_subgroups"), ("512", "size_control,full_subgroups"), ("256", "shuffle")]
    {
        let run = |args: &[&str]| {
            let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
            command.env("LP_NATIVE_VECTOR_WIDTH", width).env("LABELGS_HIDE", hidden).env("LABELGS_VALIDATION", "off");
            let output = command.args(args).output().expect("it runs");
            assert_eq!(output.status.code(), Some(0), "{width} {hidden}: {}", text(&output.stderr));
            text(&output.stdout)
        };
        assert_eq!(json(&run(&["devices", "--json"]))["devices"][0]["kernels"]["emulated"], true, "{width} {hidden}");
        run(&["profile", &place.text("scene"), "--steps", "1"]);
    }
}

/// Driver files of the usual device and of SwiftShader together, where both are known.
fn two_drivers() -> Option<String> {
    let set = |name: &str| std::env::var(name).ok().filter(|file| file != "none");
    Some(format!("{}:{}", set("VK_DRIVER_FILES")?, set("LABELGS_SWIFTSHADER")?))
}

/// Processes with lists of devices share these out, also after one is killed.
#[test]
fn a_list_of_devices_means_the_first_that_is_free() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let devices = |list: &str| place.labelgs(&["devices", "--device", list, "--json"]);
    assert_eq!(devices("0,").status.code(), Some(0));
    let long = ["--device", "0,", "--iterations", "100000", "--checkpoint-every", "4"];
    let mut holder = place.spawned(&place.train("out", &long));
    while place.checkpoints("out").is_empty() {
        assert!(holder.try_wait().expect("a child").is_none(), "it trains");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let name = json(&text(&devices("0").stdout))["devices"][0]["name"].as_str().expect("text").to_owned();
    let kind = name.split(' ').next().expect("a word");
    for list in ["0,", "0,0", &format!(" 0 , {kind},")] {
        let output = devices(list);
        assert_eq!(output.status.code(), Some(4), "{list}");
        let said = text(&output.stderr);
        assert!(said.contains("in use by other labelgs processes") && said.contains(&format!("0: {name}")), "{said}");
    }
    let second = ["--device", "0,", "--iterations", "4"];
    assert_eq!(place.trained("second", &second).status.code(), Some(4));
    // Without a list nobody looks at locks; another device is free.
    assert_eq!(devices("0").status.code(), Some(0));
    let output = devices("0,no such device");
    assert!(text(&output.stderr).contains("no device matches no such device"), "{}", text(&output.stderr));
    if let Some(drivers) = two_drivers() {
        let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
        command.env("VK_DRIVER_FILES", &drivers).env("VK_ICD_FILENAMES", &drivers);
        let output =
            command.args(["devices", "--device", &format!("{kind},SwiftShader"), "--json"]).output().expect("it runs");
        let found = json(&text(&output.stdout));
        let picked = found["devices"].as_array().expect("a list").iter().find(|row| row["picked"] == true);
        assert!(picked.is_some_and(|row| row["name"].as_str().is_some_and(|name| name.contains("SwiftShader"))));
    }
    holder.kill().expect("a kill");
    holder.wait().expect("its end");
    assert_eq!(devices("0,").status.code(), Some(0));
    succeeded(&place.trained("second", &second));
}

#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_plan_that_does_not_fit_is_printed_and_fails() {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let args = ["plan", "--gaussians", "2k", "--size", "160x120", "--json"];
    let output = command.env("LABELGS_LIMIT_SSBO", "64K").args(args).output().expect("it runs");
    if device().is_none() {
        return;
    }
    assert_eq!(output.status.code(), Some(5), "{}", text(&output.stderr));
    let plan = json(&text(&output.stdout));
    assert!(
        plan["fits"] == false && plan["problem"].as_str().is_some_and(|text| text.contains("65536")),
        "{}",
        plan["problem"]
    );
}
