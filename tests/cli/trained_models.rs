//! A trained model begins another training, or becomes simpler.

use crate::support::device;
use crate::support::runs::{Place, copy, stderr, succeeded};
use glam::DVec3;
use labelgs::formats::{read_model, write_model};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

/// PSNR of the test views at the end of a run.
fn psnr(place: &Place, out: &str) -> f64 {
    json(&place.path(out).join("metrics.json"))["test"]["psnr"].as_f64().expect("a number")
}

#[test]
fn a_training_goes_on_from_a_model_of_any_format() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("first", &["--iterations", "200"]));
    succeeded(&place.labelgs(&["convert", &place.text("first"), &place.text("first.spz")]));
    let [folder, file] = [place.text("first"), place.text("first.spz")];
    succeeded(&place.trained("anew", &["--iterations", "4"]));
    let (first, anew) = (psnr(&place, "first"), psnr(&place, "anew"));
    for (out, init) in [("of-folder", &folder), ("of-file", &file)] {
        succeeded(&place.trained(out, &["--init", init, "--iterations", "4", "--checkpoint-every", "2"]));
        let found = psnr(&place, out);
        assert!(found > first - 1.0 && found > anew + 1.0, "{out}: {found} dB, {first} before, {anew} from points");
    }
    let again = place.trained("of-file", &["--init", &file, "--resume", "--iterations", "6"]);
    assert!(succeeded(&again).contains("first.spz is not read again"), "{}", stderr(&again));

    let scene = place.text("scene");
    let plain = place.labelgs(&["train", &scene, "-o", &place.text("plain"), "--init", &file, "--iterations", "2"]);
    assert!(succeeded(&plain).contains("initial model's labels are dropped"), "{}", stderr(&plain));

    let missing = place.trained("missing", &["--init", &place.text("nothing.ply"), "--iterations", "2"]);
    assert_eq!(missing.status.code(), Some(3));
    assert!(stderr(&missing).contains("nothing.ply"), "{}", stderr(&missing));
}

#[test]
fn the_gaussians_that_contribute_most_stay() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "200"]));
    let (scene, masks) = (place.text("scene"), place.text("scene/masks"));
    let simplified = |goal: [&str; 2], output: &str| -> Value {
        let typed = ["simplify", &place.text("out"), "--scene", &scene, "--masks", &masks, "--json", "-o"];
        let done = place.labelgs(&[&typed[..], &[&place.text(output)], &goal].concat());
        succeeded(&done);
        serde_json::from_slice(&done.stdout).expect("JSON")
    };
    let half = simplified(["--gaussians", "120"], "some.ply");
    assert_eq!((&half["gaussians"], &half["chosen"]["gaussians"]), (&120.into(), &120.into()));
    let whole = read_model(place.text("out/point_cloud/iteration_200/point_cloud.ply")).expect("a model").gaussians;
    let some = read_model(place.text("some.ply")).expect("a model").gaussians;
    let labels = |labels: Option<&Vec<u32>>| labels.into_iter().flatten().copied().collect::<BTreeSet<u32>>();
    assert_eq!(labels(some.labels.as_ref()), labels(whole.labels.as_ref()), "no label is lost");

    // As many at random are worse.
    let step = whole.len() / 120;
    let random = whole.filtered(|row| row % step == 0 && row / step < 120);
    assert_eq!(random.len(), 120);
    write_model(place.path("random.ply"), &random).expect("written");
    let scores = place.text("scores.json");
    succeeded(&place.labelgs(&["eval", &place.text("random.ply"), "--scene", &scene, "--json", &scores]));
    let at_random = json(Path::new(&scores))["mean"]["psnr"].as_f64().expect("a number");
    let chosen = half["chosen"]["psnr"].as_f64().expect("a number");
    assert!(chosen > at_random + 1.0, "{chosen} dB, at random {at_random} dB");

    let near = simplified(["--psnr-loss", "0.2"], "near.ply");
    let all = near["table"][0]["psnr"].as_f64().expect("a number");
    assert!(near["chosen"]["psnr"].as_f64().expect("a number") >= all - 0.2, "{near}");
    assert!(near["gaussians"].as_u64() < near["of"].as_u64(), "{near}");
}

#[test]
fn damaged_cameras_of_a_run_matter_to_pages_only() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "20"]));
    let out = place.text("out");
    let convert = |name: &str| place.labelgs(&["convert", &out, &place.text(name)]);
    succeeded(&convert("before.html"));
    std::fs::write(place.path("out/cameras.json"), "[{}]").expect("written");
    let plain = convert("model.ply");
    assert!(succeeded(&plain).contains("will have no initial view"), "{}", stderr(&plain));
    let page = convert("after.html");
    assert_eq!(page.status.code(), Some(3), "{}", stderr(&page));
    assert!(
        stderr(&page).contains("cameras.json: line 1: ") && !place.path("after.html").exists(),
        "{}",
        stderr(&page)
    );
    let text = std::fs::read_to_string(place.path("before.html")).expect("a page");
    assert!(text.contains(r#""view":{"eye":["#), "the page begins at the first photo");
}

#[test]
fn a_part_of_a_model_says_where_it_was_seen_from() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "200"]));
    let out = place.text("out");
    let made = |words: &[&str], name: &str| {
        succeeded(&place.labelgs(&[words, &["-o", &place.text(name)]].concat()));
        read_model(place.path(name)).expect("a model")
    };
    let trained = read_model(place.path("out/point_cloud/iteration_200/point_cloud.ply")).expect("a model");
    assert_eq!(trained.first_view, None, "a training writes what others write");
    let object = made(&["extract", &out, "--labels", "1"], "object.ply");
    let view = object.first_view.expect("a view");
    assert!(view.up.dot(DVec3::Z) > 0.9, "the made scene has z up: {}", view.up);
    // From a camera of the run, with the object before it.
    let cameras: Vec<Value> =
        serde_json::from_slice(&std::fs::read(place.path("out/cameras.json")).expect("a list")).expect("JSON");
    let own = |camera: &Value| {
        let of = |value: &Value| DVec3::from_array([0, 1, 2].map(|axis| value[axis].as_f64().expect("a number")));
        let rows = [0, 1, 2].map(|row| of(&camera["rotation"][row]));
        (of(&camera["position"]), DVec3::new(rows[0].z, rows[1].z, rows[2].z))
    };
    let (eye, ahead) = cameras.iter().map(own).find(|(eye, _)| eye.distance(view.eye) < 1e-9).expect("a camera");
    let middle = (0..object.gaussians.len()).map(|row| object.gaussians.world(row)).sum::<DVec3>();
    assert!((middle / object.gaussians.len() as f64 - eye).normalize().dot(ahead) > 0.8);

    // It goes on from file to file, and turns along.
    let file = place.text("object.ply");
    assert_eq!(made(&["recolour", &file, "--labels", "1", "--colour", "red"], "red.ply").first_view, Some(view));
    succeeded(&place.labelgs(&["convert", &file, &place.text("object.spz")]));
    assert_eq!(read_model(place.path("object.spz")).expect("a model").first_view, Some(view));
    let turned = made(&["transform", &place.text("object.spz"), "--up", "z", "--scale", "2"], "turned.ply");
    let turned = turned.first_view.expect("a view");
    assert!(turned.up.dot(DVec3::NEG_Y) > 0.9, "{}", turned.up);
    let farther = DVec3::new(view.eye.x, -view.eye.z, view.eye.y) * 2.0;
    assert!(turned.eye.distance(farther) < 1e-5, "{} {farther}", turned.eye);
}

#[test]
fn refined_poses_are_a_reconstruction_of_their_own() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--refine-poses", "--iterations", "40"]));
    let config = std::fs::read_to_string(place.path("out").join("config.toml")).expect("settings");
    assert!(config.contains("depth_weight = 0.3"), "points and poses are of one reconstruction: {config}");
    let (scene, again) = (place.path("scene"), place.path("again"));
    copy(&scene, &again);
    std::fs::remove_dir_all(again.join("sparse")).expect("a reconstruction");
    copy(&place.path("out").join("refined"), &again.join("sparse/0"));
    succeeded(&place.labelgs(&["train", &place.text("again"), "-o", &place.text("more"), "--iterations", "2"]));
    let cameras = |out: &str| json(&place.path(out).join("cameras.json"));
    let (refined, read) = (cameras("out"), cameras("more"));
    succeeded(&place.trained("plain", &["--iterations", "2"]));
    let (mut moved, plain) = (0, cameras("plain"));
    let number = |value: &Value| value.as_f64().expect("a number");
    for ((refined, read), plain) in refined
        .as_array()
        .expect("a list")
        .iter()
        .zip(read.as_array().expect("a list"))
        .zip(plain.as_array().expect("a list"))
    {
        assert_eq!(refined["img_name"], read["img_name"]);
        for axis in 0..3 {
            let [refined, read, plain] = [refined, read, plain].map(|of| number(&of["position"][axis]));
            assert!((refined - read).abs() < 1e-6, "{refined} {read}");
            moved += usize::from((refined - plain).abs() > 1e-6);
        }
    }
    assert!(moved > 0, "no pose was refined");
}
