//! `label`, `masks repair` and `ablate` on a small scene.

use crate::support;
use assert_cmd::Command;
use labelgs::edit::strokes::{Stroke, StrokesFile};
use labelgs::files::label_table::LabelTable;
use labelgs::formats::read_model;
use labelgs::masks::read_mask;
use labelgs::scene::LabelMap;
use serde_json::Value;
use std::path::Path;

#[track_caller]
fn labelgs(args: &[&str], status: i32) -> String {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let output = command.env("LABELGS_VALIDATION", "off").args(args).output().expect("it runs");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(status), "{args:?}: {err}");
    if status == 0 { out.into_owned() } else { err.into_owned() }
}

#[track_caller]
fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// A stroke across a mask's id, through the pixel that is farthest from its border.
fn stroke(mask: &LabelMap, id: u16) -> Stroke {
    let depths = mask.depths(id);
    let at = (0..depths.len()).max_by_key(|&at| depths[at]).expect("pixels") as u32;
    let (x, y) = (at % mask.width, at / mask.width);
    let is_in = |x: &u32| mask.get(*x, y) == Some(id);
    let [left, right] = [(0..=x).rev().take_while(is_in).last(), (x..).take_while(is_in).last()];
    let points = [left, right].into_iter().flatten().map(|x| [f64::from(x), f64::from(y)]).collect();
    let (view, label, name) = ("003".into(), u32::from(id), (id == 2).then(|| "second".to_owned()));
    Stroke { view, points, radius: 0.0, label, name, on: true }
}

/// Strokes on each object in one view, compared with the votes of all masks.
fn strokes_make_objects(folder: &Path) {
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let labels = |name: &str| read_model(folder.join(name)).expect("a model").gaussians.labels.expect("labels");
    let (plain, scene, file, cut) = (path("plain"), path("scene"), path("strokes.json"), path("cut.ply"));
    let write = |strokes: Vec<Stroke>| {
        let text = serde_json::to_string(&StrokesFile::new(strokes)).expect("JSON");
        std::fs::write(&file, text).expect("a file");
    };
    let mask = read_mask(folder.join("scene/masks/003.png")).expect("a mask");
    let strokes: Vec<Stroke> = (0..=3).map(|id| stroke(&mask, id)).collect();
    write(strokes.clone());
    let label = ["label", &plain, "--scene", &scene, "--strokes", &file, "-o", &cut];
    let said = json(&labelgs(&[&label[..], &["--json", "-q"]].concat(), 0));
    assert_eq!((&said["strokes"], said["labels"].as_array().map(Vec::len)), (&Value::from(4), Some(3)), "{said}");
    let (truth, found) = (labels("labelled.ply"), labels("cut.ply"));
    for id in 1..=3 {
        let of = |both: bool| {
            let rows = truth.iter().zip(&found).map(|(a, b)| (*a == id, *b == id));
            rows.filter(|&(a, b)| if both { a && b } else { a || b }).count()
        };
        assert!(2 * of(true) > of(false), "object {id}: {} of {}", of(true), of(false));
    }
    let table = LabelTable::read(&folder.join("cut.labels.json")).expect("names");
    assert_eq!((table.id_of("second"), table.name(1)), (Some(2), None));

    // A stroke that leaves its photo, or is of no view, is told by its number.
    let wrong = |change: &dyn Fn(&mut Stroke), expected: &str| {
        let mut strokes = strokes.clone();
        change(&mut strokes[2]);
        write(strokes);
        let said = labelgs(&label, 3);
        assert!(said.contains("strokes.json") && said.contains("stroke 3") && said.contains(expected), "{said}");
    };
    wrong(&|stroke| stroke.points.push([96.0, 3.0]), "point 3 (96, 3) is outside of the photo, which has 96 x 72 px");
    wrong(&|stroke| stroke.view = "nowhere".into(), "no view is called nowhere");
    let both = labelgs(&[&label[..], &["--masks", &path("scene/masks")]].concat(), 2);
    assert!(both.contains("--strokes") && both.contains("--masks"), "{both}");
}

/// Pixels of each id in a mask.
fn areas(mask: &Path) -> std::collections::BTreeMap<u16, usize> {
    let mut areas = std::collections::BTreeMap::new();
    read_mask(mask).expect("mask").ids.iter().for_each(|&id| *areas.entry(id).or_default() += 1);
    areas
}

#[test]
fn a_model_without_labels_gets_them_and_mends_masks() {
    let Some(_turn) = support::device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (scene, masks, plain, model) = (path("scene"), path("scene/masks"), path("plain"), path("labelled.ply"));
    labelgs(&["synth", &scene, "--preset", "simple", "--size", "96x72", "--views", "12", "--points", "1500", "-q"], 0);
    labelgs(&["train", &scene, "--iterations", "250", "--set", "preview_every=0", "-o", &plain, "-q"], 0);

    let found =
        json(&labelgs(&["label", &plain, "--scene", &scene, "--masks", &masks, "-o", &model, "--json", "-q"], 0));
    assert_eq!(found["schema_version"], 1);
    let read = read_model(&model).expect("model").gaussians;
    let confidence = read.label_confidence.expect("votes tell how sure they are");
    assert!(confidence.iter().all(|share| (0.0..=1.0).contains(share)));
    let labels: std::collections::BTreeSet<u32> = read.labels.expect("labels").into_iter().collect();
    assert_eq!(labels, [0, 1, 2, 3].into());
    let scores = json(&labelgs(&["eval", &model, "--scene", &scene, "--masks", &masks, "--json", "-q"], 0));
    let iou = scores["mean"]["iou_map"].as_f64().expect("a score");
    assert!(iou > 0.8, "{iou} after a short training");
    // The paper's rule labels fewer Gaussians of the same model.
    let main = path("main.ply");
    let rule = ["label", &plain, "--scene", &scene, "--masks", &masks, "--rule", "main", "-o", &main, "-q"];
    labelgs(&rule, 0);
    let of_rule = read_model(&main).expect("model").gaussians.labels.expect("labels");
    let count = |labels: &[u32]| labels.iter().filter(|&&label| label != 0).count();
    let votes = read_model(&model).expect("model").gaussians.labels.expect("labels");
    assert!(count(&of_rule) < count(&votes) && count(&of_rule) > 0);

    strokes_make_objects(folder.path());

    // Give each view its own ids, then repair them.
    let (spoilt, mended) = (path("spoilt"), path("mended"));
    labelgs(&["masks", "spoil", &masks, "--fault", "per-view", "-o", &spoilt, "-q"], 0);
    let repair =
        ["masks", "repair", &spoilt, "--per-view", "--model", &plain, "--scene", &scene, "-o", &mended, "--json"];
    let report = json(&labelgs(&repair, 0));
    assert_eq!(report["objects"], serde_json::json!([1, 2, 3]), "{report}");
    let mut wrong = 0;
    for view in (0..12).filter(|view| view % 8 != 0) {
        let name = format!("{view:03}.png");
        let (truth, ours) = (areas(&Path::new(&masks).join(&name)), areas(&Path::new(&mended).join(&name)));
        // Objects are numbered by size, so areas are compared.
        let sorted = |areas: &std::collections::BTreeMap<u16, usize>| {
            let mut sizes: Vec<usize> = areas.iter().filter(|(id, _)| **id != 0).map(|(_, &size)| size).collect();
            sizes.sort_unstable();
            sizes
        };
        wrong += usize::from(sorted(&truth) != sorted(&ours));
    }
    assert!(wrong <= 2, "{wrong} masks changed their outlines");
    let again = labelgs(&repair, 2);
    assert!(again.contains("is not empty"), "{again}");
}

#[test]
fn an_ablation_compares_variants() {
    let Some(_turn) = support::device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (scene, masks, out) = (path("scene"), path("scene/masks"), path("out"));
    labelgs(&["synth", &scene, "--preset", "simple", "--size", "64x48", "--views", "9", "--points", "500", "-q"], 0);
    let common = ["--", "--iterations", "40", "--set", "label_from=10", "--set", "preview_every=0"];
    let mut args = vec!["ablate", &scene, "--masks", &masks, "-o", &out, "--rows", "no-labels,ours", "-q"];
    args.extend(["--row", "half=--set label_weight=0.5"]);
    args.extend(common);
    let table = labelgs(&args, 0);
    for part in ["no-labels", "ours", "half", "iou_hidden", "from the LabelGS paper", "0.925 / 34.26"] {
        assert!(table.contains(part), "{part} is not in\n{table}");
    }
    let record = json(&std::fs::read_to_string(Path::new(&out).join("ablation.json")).expect("record"));
    let rows = record["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 3);
    assert!(rows.iter().all(|row| row["runs"][0]["scores"]["psnr"].as_f64() > Some(5.0)), "{record}");
    let page = std::fs::read_to_string(Path::new(&out).join("report.html")).expect("a page");
    assert!(page.contains("3 runs") && page.contains("half-0") && page.contains("from the LabelGS paper"));
    let wrong = labelgs(&["ablate", &scene, "--masks", &masks, "-o", &out, "--row", "x=--no-such-flag 1"], 2);
    assert!(wrong.contains("x: ") && wrong.contains("--no-such-flag"), "{wrong}");
}
