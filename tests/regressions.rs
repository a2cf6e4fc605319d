//! Failures that users of other trainers reported and that no other module tests; tests/README.md has the whole list.

use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use labelgs::shaders;
use rspirv::dr::Operand;
use rspirv::spirv::{Capability, Op};

/// No kernel uses atomics on floats (missing on some devices, no fixed order of sums) or 64-bit types (also missing).
#[test]
fn no_kernel_has_atomics_on_floats() {
    for shader in shaders::ALL {
        let module = rspirv::dr::load_bytes(shader.spirv).unwrap_or_else(|error| panic!("{}: {error}", shader.name));
        for instruction in module.all_inst_iter() {
            let opcode = instruction.class.opcode;
            assert!(
                !matches!(opcode, Op::AtomicFAddEXT | Op::AtomicFMinEXT | Op::AtomicFMaxEXT),
                "{}: {opcode:?}",
                shader.name
            );
            if let [Operand::Capability(needed)] = instruction.operands.as_slice() {
                assert!(
                    !matches!(
                        needed,
                        Capability::AtomicFloat32AddEXT
                            | Capability::Int64Atomics
                            | Capability::Int64
                            | Capability::Float64
                    ),
                    "{} needs {needed:?}",
                    shader.name
                );
            }
        }
    }
}

/// The program under the validation layer: a message of the layer is a bug with its own exit status.
#[test]
fn commands_break_no_rule_of_vulkan() {
    let Some(turn) = device() else { return };
    if !turn.is_validated() {
        return;
    }
    let place = Place::new();
    let [scene, masks, out] = ["scene", "scene/masks", "out"].map(|name| place.text(name));
    let mode = std::env::var("LABELGS_VALIDATION").unwrap_or("on".to_owned());
    let (settings, lifted) = (place.settings(), place.text("lifted.ply"));
    let commands: [&[&str]; 6] = [
        &["train", &scene, "-o", &out, "--masks", &masks, "--config", &settings],
        &["train", &scene, "-o", &out, "--masks", &masks, "--resume", "--iterations", "44"],
        &["render", &out, "--scene", &scene, "--what", "rgb,labels,depth", "-o", &place.text("pictures")],
        &["label", &out, "--scene", &scene, "--masks", &masks, "-o", &lifted],
        &["eval", &out, "--scene", &scene, "--masks", &masks],
        &["occlusion", &scene, "--masks", &masks, "--model", &out, "-o", &place.text("occlusion.json")],
    ];
    for args in commands {
        let mut command = assert_cmd::Command::cargo_bin("labelgs").expect("the tool is built");
        let output = command.env("LABELGS_VALIDATION", &mode).env("LABELGS_CACHE", "off").args(args).output();
        succeeded(&output.expect("it runs"));
    }
}

/// Labels above those of the masks, up to 65535: tables with a row per id of the masks have no row for them.
#[test]
fn labels_beyond_those_of_the_masks_are_handled() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let [scene, masks, model] = ["scene", "scene/masks", "model.ply"].map(|name| place.text(name));
    succeeded(&place.trained("out", &["--config", &place.settings()]));
    let found = place.path("out/point_cloud/iteration_40/point_cloud.ply");
    let mut gaussians = labelgs::formats::read_model(&found).expect("a model").gaussians;
    let labels = gaussians.labels.as_mut().expect("labels");
    labels.iter_mut().step_by(3).for_each(|label| *label = 65_535);
    labelgs::formats::write_model(&model, &gaussians).expect("written");
    let commands: [&[&str]; 6] = [
        &["list", &model],
        &["render", &model, "--scene", &scene, "--what", "rgb,labels", "-o", &place.text("pictures")],
        &["render", &model, "--scene", &scene, "--only", "65535", "-o", &place.text("one")],
        &["eval", &model, "--scene", &scene, "--masks", &masks],
        &["label", &model, "--scene", &scene, "--masks", &masks, "-o", &place.text("again.ply")],
        &["remove", &model, "--labels", "65535", "-o", &place.text("rest.ply")],
    ];
    for args in commands {
        succeeded(&place.labelgs(args));
    }
}

/// A device limits buffers below what a training would grow to. The training goes on with the Gaussians that fit, or
/// ends with an error that has the numbers; it never exceeds the limit.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_training_stays_within_the_limits_of_a_device() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings(), "--set", "densify_grad_threshold=1e-9"];
    let free = succeeded(&place.trained("free", &flags));
    let bound = "from here, only the best may grow";
    assert!(!free.contains(bound), "{free}");
    let mut outcomes = std::collections::BTreeMap::new();
    for (name, limit) in [
        ("SSBO", "96K"),
        ("SSBO", "160K"),
        ("SSBO", "256K"),
        ("TEXELS", "16K"),
        ("ALLOCATION", "256K"),
        ("MEMORY", "8M"),
        ("MEMORY", "10M"),
    ] {
        let out = format!("{name}-{limit}");
        let mut command = assert_cmd::Command::cargo_bin("labelgs").expect("the tool is built");
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
        command.env(format!("LABELGS_LIMIT_{name}"), limit).args(place.train(&place.text(&out), &flags));
        let output = command.output().expect("it runs");
        let said = stderr(&output);
        let outcome = match output.status.code() {
            Some(0) if said.contains(bound) => "with a bound",
            Some(0) => "as without",
            Some(5) if said.contains(" bytes, ") && said.contains("lower ") => "refused with numbers",
            other => panic!("{out}: {other:?}; {said}"),
        };
        *outcomes.entry(outcome).or_insert(0) += 1;
        if output.status.success() {
            assert!(!place.model(&out, 40).is_empty());
        }
    }
    println!("{outcomes:?}");
    assert!(outcomes.contains_key("with a bound") && outcomes.contains_key("refused with numbers"), "{outcomes:?}");
}

/// A model is refused as a checkpoint under any file name, because it lacks the moments of Adam.
#[test]
fn a_model_in_the_place_of_a_checkpoint_is_refused() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "4", "--checkpoint-every", "4"]));
    let model = place.path("out/point_cloud/iteration_4/point_cloud.ply");
    std::fs::copy(&model, place.path("out/checkpoints/9-step-4.ckpt")).expect("a copy");
    let said = succeeded(&place.trained("out", &["--resume", "--iterations", "6"]));
    assert!(said.contains("9-step-4.ckpt") && said.contains("trying the previous checkpoint"), "{said}");
    for found in place.checkpoints("out") {
        std::fs::copy(&model, &found.path).expect("a copy");
    }
    let output = place.trained("out", &["--resume", "--iterations", "8"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    // A model in place of the scene or the settings is refused too.
    let model = model.to_str().expect("text");
    for args in [
        ["train", model, "-o", &place.text("other")].as_slice(),
        &["train", &place.text("scene"), "-o", &place.text("other"), "--config", model],
    ] {
        let output = place.labelgs(args);
        assert!(matches!(output.status.code(), Some(2 | 3)), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("point_cloud.ply"), "{args:?}: {}", stderr(&output));
    }
}

/// When no Gaussian is left, the error says so and lists likely causes.
#[test]
fn a_training_that_prunes_everything_says_so() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = [
        "--config",
        &place.settings(),
        "--set",
        "strategy=budget",
        "--set",
        "opacity_lr=1",
        "--set",
        "opacity_weight=1000",
    ];
    let output = place.trained("out", &flags);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("after step 8") && said.contains("poses do not fit"), "{said}");
    assert!(!said.contains("training restarts from"), "the same would come again: {said}");
    assert!(!place.checkpoints("out").is_empty(), "the checkpoint before is still there");
}
