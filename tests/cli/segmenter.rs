//! From photos to objects, by a network and by instances of single photos.

use crate::support::segmenter::{largest_object, paint, tiny};
use assert_cmd::Command;
use labelgs::files::LabelTable;
use labelgs::formats::read_model;
use labelgs::masks::read_mask;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs a command in a folder.
#[track_caller]
fn labelgs(folder: &Path, line: &str) -> String {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", folder.join("cache")).current_dir(folder);
    let output = command.args(line.split(' ')).output().expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{line}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Runs a command that fails, and returns what it says.
#[track_caller]
fn refusal(folder: &Path, line: &str) -> String {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let output = command.current_dir(folder).args(line.split(' ')).output().expect("it runs");
    assert!(!output.status.success(), "{line} does not fail");
    text(&output.stderr)
}

/// A scene.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    labelgs(folder.path(), "synth scene --preset simple --size 96x72 --views 12 --points 400");
    folder
}

/// Returns for each true object the id with the largest IoU in some masks, and that IoU.
fn best_ids(folder: &Path, masks: &str) -> BTreeMap<u16, (u16, f64)> {
    let mut counts: BTreeMap<(u16, u16), u32> = BTreeMap::new();
    for view in 0..12 {
        let [found, truth] = [masks, "scene/masks"]
            .map(|place| read_mask(folder.join(place).join(format!("{view:03}.png"))).expect("ids"));
        truth.ids.iter().zip(&found.ids).for_each(|(&t, &f)| *counts.entry((t, f)).or_default() += 1);
    }
    let sum = |of: &dyn Fn(&(u16, u16)) -> bool| {
        counts.iter().filter(|(key, _)| of(key)).map(|(_, &count)| count).sum::<u32>()
    };
    let mut best: BTreeMap<u16, (u16, f64)> = BTreeMap::new();
    for (&(truth, found), &both) in counts.iter().filter(|((truth, found), _)| *truth != 0 && *found != 0) {
        let either = sum(&|key| key.0 == truth) + sum(&|key| key.1 == found) - both;
        let iou = f64::from(both) / f64::from(either);
        let known = best.entry(truth).or_insert((found, iou));
        if iou > known.1 {
            *known = (found, iou);
        }
    }
    best
}

#[test]
fn photos_become_objects_by_a_network_alone() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = place();
    let folder = folder.path();
    paint(&folder.join("scene"));
    tiny::write(&folder.join("net"));
    let make = "masks make scene --network net -o made --grid 5";
    let said = labelgs(folder, make);
    assert!(said.contains("in 12 photos; 0 were done before"), "{said}");
    // A stopped run goes on, with what it knows of the photos.
    let list = folder.join("made/nested/004.json");
    let before = std::fs::read(&list).expect("a list");
    std::fs::remove_file(&list).expect("removed");
    let said = labelgs(folder, make);
    assert!(said.contains("in 1 photo; 11 were done before"), "{said}");
    assert!(std::fs::read(&list).expect("a list") == before);
    let refused = refusal(folder, "masks make scene --network net -o made --grid 6");
    assert!(refused.contains("masks.json") && refused.contains("use a new folder"), "{refused}");
    let levels = best_ids(folder, "made/objects");
    assert_eq!(levels.len(), 3, "{levels:?}");

    from_photos_to_labels(folder);
    labelgs(folder, "masks repair made --model plain --scene scene -o repaired");
    let found = best_ids(folder, "repaired");
    let ids: BTreeSet<u16> = found.values().map(|(id, _)| *id).collect();
    // Cells of the network are 1.5 px here: a ring of one around an object of 16 px across is a third of it.
    assert!(ids.len() == 3 && found.values().all(|(_, iou)| *iou > 0.5), "{found:?}");
    labelgs(folder, "label plain --scene scene --masks made -o labelled.ply");
    labelgs(folder, &format!("extract labelled.ply --labels {} -o object.ply", found[&1].0));
    let [all, object] =
        ["labelled.ply", "object.ply"].map(|name| read_model(folder.join(name)).expect("a model").gaussians);
    assert!(!object.is_empty() && object.len() < all.len() / 2, "{} of {} Gaussians", object.len(), all.len());
    one_click_is_one_object(folder);
}

/// Trains, makes masks and labels in one command, once killed when it makes masks; leaves the model without labels in
/// `plain`.
fn from_photos_to_labels(folder: &Path) {
    // Flat colours are learned slowly.
    let train = "train scene --network net --iterations 300 -o";
    let mut killed = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"));
    killed.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", folder.join("cache")).current_dir(folder);
    let mut killed = killed.args(format!("{train} out").split(' ')).stderr(Stdio::null()).spawn().expect("it runs");
    while !folder.join("out/masks/nested").is_dir() {
        assert!(killed.try_wait().expect("a child").is_none(), "it ends before it is killed");
        std::thread::sleep(Duration::from_millis(5));
    }
    killed.kill().and_then(|()| killed.wait()).expect("killed");
    std::fs::create_dir_all(folder.join("plain/point_cloud/iteration_300")).expect("a folder");
    for file in ["config.toml", "point_cloud/iteration_300/point_cloud.ply"] {
        std::fs::copy(folder.join("out/plain").join(file), folder.join("plain").join(file)).expect("copied");
    }
    labelgs(folder, &format!("{train} out --resume"));
    let bytes = |file: &str| std::fs::read(folder.join("out").join(file)).expect("a file");
    let files = ["point_cloud/iteration_100/point_cloud.ply", "labels.json", "masks/agreed/007.png"];
    let resumed = files.map(bytes);
    let metrics: serde_json::Value = serde_json::from_slice(&bytes("metrics.json")).expect("JSON");
    // From the first step again, and not killed.
    labelgs(folder, &format!("{train} out"));
    for (file, before) in files.iter().zip(resumed) {
        assert!(bytes(file) == before, "{file}");
    }
    let found = best_ids(folder, "out/masks/agreed");
    assert!(found.len() == 3 && found.values().all(|(_, iou)| *iou > 0.5), "{found:?}");
    // It is a run with masks like others: list, metrics and report have its objects.
    let objects = metrics["objects"].as_array().expect("objects").len();
    assert!(objects >= 3 && metrics["test"]["iou_map"].as_f64().is_some_and(|iou| iou > 0.5), "{metrics}");
    let listed: serde_json::Value = serde_json::from_str(&labelgs(folder, "list out --json")).expect("JSON");
    let labels = listed["labels"].as_array().map_or(0, |rows| rows.iter().filter(|row| row["label"] != 0).count());
    assert_eq!(labels, objects, "{listed}");
    let report = String::from_utf8(bytes("report.html")).expect("text");
    assert!(report.contains("out/masks/agreed") && !report.contains("No objects: "));
    let refused = refusal(folder, &format!("{train} other --masks scene/masks"));
    assert!(refused.contains("--network") && refused.contains("--masks"), "{refused}");
}

/// Clicks on the object of which view 003 shows most, and compares with what all true masks say.
fn one_click_is_one_object(folder: &Path) {
    let (object, [x, y]) = largest_object(&folder.join("scene"), "003");
    let said = labelgs(
        folder,
        &format!("label plain --scene scene --network net --click 003:{x},{y} --name it -o clicked.ply"),
    );
    assert!(said.contains("object 1 (it)"), "{said}");
    labelgs(folder, "label plain --scene scene --masks scene/masks -o true.ply");
    let labels = |name: &str| read_model(folder.join(name)).expect("a model").gaussians.labels.expect("labels");
    let truth = labels("true.ply");
    // The model is coarse after so few steps: of what was found, most is this object, and no other one.
    let judge = |name: &str| {
        let found = labels(name);
        let of = |label: u32| found.iter().zip(&truth).filter(|(a, b)| **a == 1 && **b == label).count();
        let (own, others) = (of(u32::from(object)), (1..=3).map(of).sum::<usize>());
        assert!(own > 20 && 10 * own >= 9 * others, "{name}: {own} of {others}");
    };
    judge("clicked.ply");
    // A box with its middle there.
    let corners = format!("003:{},{},{},{}", x - 5, y - 5, x + 6, y + 6);
    labelgs(folder, &format!("label plain --scene scene --network net --box {corners} -o boxed.ply"));
    judge("boxed.ply");
    // Labels of before stay, and a place that shows nothing is told.
    labelgs(folder, &format!("label true.ply --scene scene --network net --click 003:{x},{y} -o both.ply"));
    let both = labels("both.ply");
    assert!(truth.iter().zip(&both).all(|(before, after)| before == after || *after == 4));
    let said = refusal(folder, "label plain --scene scene --network net --click 003:999,0 -o no.ply");
    assert!(said.contains("--click: 999,0 is outside of 003.png, which has 96 x 72 px"), "{said}");
    let said = refusal(folder, "label plain --scene scene --network net --box 003:90,60,97,72 -o no.ply");
    assert!(said.contains("--box: 96,71 is outside of 003.png"), "{said}");
}

#[test]
fn names_of_imported_instances_survive_a_repair() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = place();
    let folder = folder.path();
    let names = LabelTable::read(&folder.join("scene/masks/labels.json")).expect("names");
    // Instances of COCO as runs, in another order in each photo, all objects but one called `thing`.
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    for view in 0..12 {
        let mask = read_mask(folder.join(format!("scene/masks/{view:03}.png"))).expect("ids");
        images.push(serde_json::json!({"id": view, "file_name": format!("{view:03}.png"), "width": 96, "height": 72}));
        let mut objects = mask.objects();
        let count = objects.len().max(1);
        objects.rotate_left(view % count);
        for object in objects {
            let columns = (0..96).flat_map(|x| (0..72).map(move |y| (x, y)));
            let mut counts = vec![0_u32];
            for (x, y) in columns {
                if (mask.at(x, y) == object) == (counts.len() % 2 == 1) {
                    counts.push(0);
                }
                *counts.last_mut().expect("a run") += 1;
            }
            annotations.push(serde_json::json!({"id": annotations.len(), "image_id": view, "iscrowd": 0,
                "category_id": u32::from(object == 1), "segmentation": {"size": [72, 96], "counts": counts}}));
        }
    }
    let categories = serde_json::json!([{"id": 0, "name": "thing"}, {"id": 1, "name": "first thing"}]);
    let file = serde_json::json!({"images": images, "annotations": annotations, "categories": categories});
    std::fs::write(folder.join("instances.json"), file.to_string()).expect("written");
    let said = labelgs(folder, "masks import instances.json --scene scene -o imported");
    let next = "labelgs masks repair imported --per-view --model plain --scene scene -o repaired";
    assert!(said.contains("ids differ from photo to photo") && said.contains(next), "{said}");
    labelgs(folder, "train scene --iterations 100 -o plain");
    let said = labelgs(folder, next.strip_prefix("labelgs ").expect("a command"));
    // Held-out photos have masks too, with the same ids.
    assert!(said.contains("in 12 masks") && !said.contains(" 0 masks renamed"), "{said}");
    labelgs(folder, "label plain --scene scene --masks repaired -o repaired.ply");
    let scores = labelgs(folder, "eval repaired.ply --scene scene --masks repaired --json");
    let scores: serde_json::Value = serde_json::from_str(&scores).expect("JSON");
    assert!(scores["mean"]["iou_map"].as_f64().is_some_and(|iou| iou > 0.5), "{scores}");
    let table = LabelTable::read(&folder.join("repaired/labels.json")).expect("a table");
    let mut found: Vec<&str> = table.labels.iter().filter_map(|entry| entry.name.as_deref()).collect();
    found.sort_unstable();
    let things =
        (1..names.labels.len()).map(|number| if number == 1 { "thing".to_owned() } else { format!("thing {number}") });
    let expected: Vec<String> = std::iter::once("first thing".to_owned()).chain(things).collect();
    assert_eq!(found, expected);
}
