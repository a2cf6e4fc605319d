//! The program as it ships, without the feature `lab`: it ignores the variables of that feature.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

use assert_cmd::Command;
use support::device;
use support::runs::{Place, stderr, succeeded};

#[allow(dead_code, reason = "helpers are shared with the other binary")]
mod support {
    pub mod device;
    pub mod runs;
    pub use device::device;
}

#[test]
#[cfg_attr(feature = "lab", ignore = "needs a build without the feature `lab`")]
fn no_variable_makes_faults_or_hides_what_a_device_has() {
    let Some(_turn) = device() else { return };
    let devices = |variables: &[(&str, &str)]| {
        let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
        command.env("LABELGS_VALIDATION", "off").envs(variables.iter().copied());
        let output = command.args(["devices", "--json"]).output().expect("it runs");
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()), "{variables:?}");
        output.stdout
    };
    let plain = devices(&[]);
    for variables in [
        [("LABELGS_FAULT", "loader:1:INITIALIZATION"), ("LABELGS_HIDE", "timeline,timestamps")],
        [("LABELGS_FAULT", "vulkan:1:DEVICE_LOST:1000"), ("LABELGS_HIDE", "nothing that is known")],
        [("LABELGS_LIMIT_SSBO", "64K"), ("LABELGS_LIMIT_MEMORY", "1K")],
        [("LABELGS_LIMIT_TEXELS", "no size"), ("LABELGS_SUBGROUP_SIZE", "3")],
    ] {
        assert_eq!(devices(&variables), plain, "{variables:?}");
    }
    let place = Place::new();
    let fault = "write:1:IO:1000,read:1:IO:1000,nan:1:NUMBER:1000,vulkan:9:HOST_MEMORY:1000";
    let flags = ["--iterations", "4", "--set", "label_from=2"];
    succeeded(&place.trained("without", &flags));
    succeeded(&place.trained_with(Some(fault), "with", &flags));
    assert!(place.model("with", 4) == place.model("without", 4));
}
