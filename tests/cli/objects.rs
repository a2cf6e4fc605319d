//! An object on a turntable: the fault is found, and the object is trained alone.

use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use labelgs::formats::read_model;
use labelgs::scenes::{LoadOptions, open};
use labelgs::synth::{self, Preset, SynthOptions};
use serde_json::Value;

/// A place with the object of a preset in the folder `turned`.
fn place(preset: Preset) -> Place {
    let place = Place::new();
    let options = SynthOptions { width: 64, height: 48, views: 18, points: 150, ..SynthOptions::for_preset(preset) };
    synth::write(&options, &place.path("turned"), &|_| Ok(())).expect("a scene");
    place
}

/// `check` names the flag, also without masks; so does a training with masks, and one without the fault says nothing.
#[test]
fn a_turntable_is_found_before_a_training_and_by_it() {
    let Some(_turn) = device() else { return };
    let place = place(Preset::TurnedOver);
    let found = place.labelgs(&["check", &place.text("turned"), "--json"]);
    assert_eq!(found.status.code(), Some(1), "{}", stderr(&found));
    let found: Value = serde_json::from_slice(&found.stdout).expect("JSON");
    let finding = &found["report"]["findings"][0];
    assert_eq!((&found["counts"]["surroundings"], &finding["fault"]), (&1.into(), &"surroundings".into()), "{found}");
    assert!(finding["cure"].as_str().is_some_and(|cure| cure.contains("masked_only")), "{finding}");
    let told = place.labelgs(&["check", &place.text("turned")]);
    assert!(String::from_utf8_lossy(&told.stdout).contains("--masks DIR --masked-only"));
    let trained = |scene: &str, flags: &[&str]| {
        let (scene, out) = (place.text(scene), place.text(&format!("{scene}-out")));
        let masks = format!("{scene}/masks");
        let args = ["train", &scene, "-o", &out, "--masks", &masks, "--iterations", "2"];
        succeeded(&place.labelgs(&[&args[..], flags].concat()))
    };
    let (with, alone, other) = (trained("turned", &[]), trained("turned", &["--masked-only"]), trained("scene", &[]));
    assert!(with.contains("do not follow the poses") && with.contains("--masked-only"), "{with}");
    assert!(!alone.contains("do not follow") && !other.contains("do not follow"), "{alone}{other}");
    let refused = place.labelgs(&["train", &place.text("turned"), "-o", &place.text("none"), "--masked-only"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("--masks"), "{}", stderr(&refused));
}

/// The object is there, labelled, with no fog around it: before and after a resume, which keeps the setting, and in the
/// scores, which follow the run.
#[test]
fn an_object_is_trained_alone() {
    let Some(_turn) = device() else { return };
    let place = place(Preset::Turntable);
    let (scene, masks, out) = (place.text("turned"), place.text("turned/masks"), place.text("out"));
    let train = |flags: &[&str]| place.labelgs(&[&["train", &scene, "-o", &out][..], flags].concat());
    succeeded(&train(&["--masks", &masks, "--masked-only", "--iterations", "60"]));
    let refused = train(&["--resume", "--iterations", "200", "--masked-only", "off"]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    succeeded(&train(&["--resume", "--iterations", "200"]));
    let settings = std::fs::read_to_string(place.path("out/config.toml")).expect("settings");
    assert!(settings.contains("masked_only = true") && settings.contains("random_background = true"), "{settings}");
    let scored = place.labelgs(&["eval", &out, "--scene", &scene, "--masks", &masks, "--json"]);
    succeeded(&scored);
    let scores: Value = serde_json::from_slice(&scored.stdout).expect("JSON");
    let mean = |path: &[&str]| path.iter().fold(&scores["mean"], |at, key| &at[key]).as_f64().expect("a score");
    let psnr = mean(&["psnr"]);
    assert!(psnr > 20.0, "{psnr} dB over the object");
    assert!(mean(&["psnr_rest"]) > 30.0, "fog: {scores}");
    assert!(mean(&["iou_object"]) > 0.9 && mean(&["iou_map"]) > 0.9, "{scores}");
    let without = place.labelgs(&["eval", &out, "--scene", &scene]);
    assert_eq!(without.status.code(), Some(2));
    assert!(stderr(&without).contains("--masks"), "{}", stderr(&without));
    // Nothing is far away from the object, and all of it is the object's.
    let model = read_model(place.path("out/point_cloud/iteration_200/point_cloud.ply")).expect("a model").gaussians;
    let dataset = open(&place.path("turned"), &LoadOptions::default()).expect("a scene");
    let reach = dataset.points.iter().map(|point| point.position.length()).fold(0.0, f64::max);
    let far = (0..model.len()).filter(|&row| model.world(row).length() > 1.5 * reach).count();
    assert!(far * 100 <= model.len(), "{far} of {} Gaussians are far away", model.len());
    let labels = model.labels.expect("labels");
    let own = labels.iter().filter(|&&label| label == 1).count();
    assert!(own * 10 >= 9 * labels.len(), "{own} of {} Gaussians have the object's label", labels.len());
}
