//! Failures that users of other trainers have reported, where no other test stands for them; tests/README.md has the whole
//! list.

use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use labelgs::shaders;
use rspirv::dr::Operand;
use rspirv::spirv::{Capability, Op};

/// Atomics on floats are missing on some devices and add in no fixed order: no kernel has any.
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
                    !matches!(needed, Capability::AtomicFloat32AddEXT | Capability::Int64Atomics | Capability::Float64),
                    "{} needs {needed:?}",
                    shader.name
                );
            }
        }
    }
}

/// A model is no checkpoint, whatever it is called: the moments of Adam would be missing.
#[test]
fn a_model_in_the_place_of_a_checkpoint_is_refused() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "4", "--checkpoint-every", "4"]));
    let model = place.path("out/point_cloud/iteration_4/point_cloud.ply");
    std::fs::copy(&model, place.path("out/checkpoints/9-step-4.ckpt")).expect("a copy");
    let said = succeeded(&place.trained("out", &["--resume", "--iterations", "6"]));
    assert!(said.contains("9-step-4.ckpt") && said.contains("the checkpoint before it is tried"), "{said}");
    for found in place.checkpoints("out") {
        std::fs::copy(&model, &found.path).expect("a copy");
    }
    let output = place.trained("out", &["--resume", "--iterations", "8"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    // A model in the place of the scene or of the settings is no better.
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

/// Where nothing is left to train, that is said, with what may have caused it.
#[test]
fn a_training_that_prunes_everything_says_so() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let flags = ["--config", &place.settings(), "--min-opacity", "0.999"];
    let output = place.trained("out", &flags);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("after step 8") && said.contains("--min-opacity"), "{said}");
    assert!(!said.contains("goes back"), "the same would come again: {said}");
    assert!(!place.checkpoints("out").is_empty(), "the checkpoint before is still there");
}
