//! The self-test passes on this device and detects every kind of fault.

use crate::reference::Rules;
use crate::support::device;
use crate::support::mutants::mutants;
use labelgs::verify::selftest;
use std::sync::Arc;

fn failures(rules: &Rules, gpu: &Arc<labelgs::gpu::Gpu>) -> Vec<String> {
    let mut failed = Vec::new();
    selftest::run_against(rules, gpu, |check| {
        if check.verdict.is_err() {
            failed.push(check.name);
        }
    })
    .expect("the device works");
    failed
}

#[test]
fn the_selftest_passes_on_this_device() {
    let Some(turn) = device() else { return };
    assert_eq!(failures(&Rules::default(), &turn.gpu()), Vec::<String>::new());
}

/// An engine that differs from the reference in one constant fails in the checks of the passes that use it.
#[test]
fn the_selftest_detects_a_fault_in_each_pass() {
    let Some(turn) = device() else { return };
    for (mutant, check) in [
        ("dilation", "projection"),
        ("sh_c2", "projection"),
        ("alpha_min", "blend forward"),
        ("ssim_c2", "photo loss and its gradient"),
        ("alpha_max", "blend backward"),
        ("label_weight", "gradient of a step with labels"),
        ("label_weight", "disagreement of labels"),
        ("adam_beta2", "Adam"),
        ("label_sums", "label map"),
        ("densify_gradient", "densification"),
        ("reset_opacity", "reset of opacities"),
        ("lift_threshold", "lift of labels by the paper's rule"),
    ] {
        let all = mutants();
        let found = all.iter().find(|found| found.name == mutant).unwrap_or_else(|| panic!("no mutant {mutant}"));
        let failed = failures(&found.rules, &turn.gpu());
        assert!(failed.iter().any(|name| name == check), "{mutant}: only {failed:?} fail");
        // The passes of a step run with both kinds of reads.
        let is_of_a_step = !["densification", "reset", "lift"].iter().any(|change| check.starts_with(change));
        let other = failed.iter().any(|name| name.starts_with(check) && name.ends_with("reads"));
        assert!(other == is_of_a_step, "{mutant}: {failed:?}");
    }
}
