//! A device with the fewest storage buffers that Vulkan allows: all buffers of a kernel share four bindings.

use crate::support::device::device;
use crate::support::runs::{Place, files, stderr, succeeded};
use std::path::Path;

/// Four storage buffers.
const BUFFER_LIMIT: (&str, &str) = ("LABELGS_LIMIT_BUFFERS", "4");

/// Kernels of a card, which read no texels on the least device.
const CARD_LIMITS: [(&str, &str); 6] = [
    ("LABELGS_LIMIT_TEXELS", "64K"),
    ("LABELGS_LOSS", "shared"),
    ("LABELGS_WALK", "group"),
    ("LABELGS_BLEND", "group"),
    ("LABELGS_SORT", "sweep"),
    ("LABELGS_UPDATE", "split"),
];

/// Pictures of a model.
fn pictures(place: &Place, run: &str, out: &str) -> Vec<Vec<u8>> {
    let (scene, run, out) = (place.text("scene"), place.text(run), place.text(out));
    let views = ["--scene", scene.as_str(), "--views", "all", "-o", &out];
    succeeded(&place.labelgs(&[&["render", run.as_str(), "--what", "rgb,labels"][..], &views].concat()));
    let mut all = files(Path::new(&out));
    all.sort();
    all.iter().map(|file| std::fs::read(file).expect("a picture")).collect()
}

/// A training with labels, that grows, is killed and resumed by the other kind, and its pictures: all bits are those of
/// a device that binds each buffer.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn buffers_that_share_bindings_change_no_bit() {
    let Some(_turn) = device() else { return };
    for forms in [&[][..], &CARD_LIMITS] {
        let few = [forms, &[BUFFER_LIMIT]].concat();
        let mut place = Place::new();
        let settings = place.settings();
        let flags = ["--config", settings.as_str()];
        let (mut models, mut drawn) = (Vec::new(), Vec::new());
        for (run, environment) in [("each", forms), ("few", &few[..])] {
            place.choose(environment);
            succeeded(&place.trained(run, &flags));
            models.push(place.model(run, 40));
            drawn.push(pictures(&place, "each", &format!("{run}-pictures")));
        }
        assert!(models[0] == models[1], "other bits with {forms:?}");
        assert!(drawn[0].len() >= 12 && drawn[0] == drawn[1], "other pictures with {forms:?}");
        // A run of each kind is killed after its first checkpoint, and goes on as the other.
        for (first, then) in [(forms, &few[..]), (&few[..], forms)] {
            place.choose(first);
            let mut child = place.spawned(&place.train("killed", &flags));
            while place.checkpoints("killed").is_empty() && child.try_wait().expect("a child").is_none() {
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
            child.kill().expect("killed or done");
            child.wait().expect("a child");
            assert!(place.checkpoints("killed").first().is_some_and(|newest| newest.step < 40), "killed too late");
            place.choose(then);
            succeeded(&place.trained("killed", &[&flags[..], &["--resume"]].concat()));
            assert!(place.model("killed", 40) == models[0], "other bits after a resume of {first:?}");
            std::fs::remove_dir_all(place.path("killed")).expect("removed");
        }
    }
}

/// The self-test passes without all that the least device lacks.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn the_selftest_passes_with_four_storage_buffers() {
    let Some(_turn) = device() else { return };
    let mut place = Place::new();
    place.choose(&[&CARD_LIMITS[..4], &[BUFFER_LIMIT]].concat());
    let output = place.labelgs(&["selftest", "--json"]);
    succeeded(&output);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["checks"].as_array().map(Vec::len), Some(44), "{found}");
}

/// A model whose buffers four bindings cannot hold is refused before anything is allocated, with the reason.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_model_that_four_bindings_do_not_hold_is_refused() {
    let Some(_turn) = device() else { return };
    let mut place = Place::new();
    let (scene, out) = (place.text("many"), place.text("out"));
    let made = ["synth", &scene, "--preset", "simple", "--size", "64x48", "--views", "6", "--points", "1500"];
    succeeded(&place.labelgs(&made));
    place.choose(&[BUFFER_LIMIT, ("LABELGS_LIMIT_SSBO", "160K")]);
    let output = place.labelgs(&["train", &scene, "--iterations", "1", "-o", &out]);
    let said = stderr(&output);
    assert!(!output.status.success() && said.contains("storage bindings of this device"), "{said}");
}
