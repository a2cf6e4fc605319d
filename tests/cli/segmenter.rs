//! The way of the paper from photos to an object, with `tools/segment.py` and a segmenter that knows the truth.

use assert_cmd::Command;
use labelgs::files::LabelTable;
use labelgs::formats::read_model;
use labelgs::masks::read_mask;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;

/// It finds a photo's true mask by the photo's pixels. As segmenters do, it also marks what is around other masks, and
/// gives masks of one object another place in the list of every photo.
const SEGMENTER: &str = r#"
import pathlib
import random
import numpy
from PIL import Image

scene = pathlib.Path(__file__).parent / "scene"
masks = {}
for path in (scene / "images").iterdir():
    masks[numpy.array(Image.open(path).convert("RGB")).tobytes()] = scene / "masks" / (path.stem + ".png")

def ids(photo):
    return numpy.array(Image.open(masks[photo.tobytes()])).astype(int)

def segment(photo):
    true = ids(photo)
    found = [true == value for value in numpy.unique(true) if value != 0] + [true != 0]
    random.Random(int(photo.sum())).shuffle(found)
    return [{"segmentation": mask} for mask in found]

def wrong(photo):
    return [numpy.ones((1, 1), bool)]

number = 3
"#;

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the script in a folder.
fn segments(python: &str, folder: &Path, flags: &[&str]) -> Output {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/segment.py");
    let mut command = std::process::Command::new(python);
    command.args(flags.iter().take_while(|flag| **flag == "-S")).arg(script);
    command.args(flags.iter().skip_while(|flag| **flag == "-S")).current_dir(folder);
    command.env("PYTHONDONTWRITEBYTECODE", "1").output().expect("it runs")
}

/// Returns the Python that has what the script needs; packages of the system are not those of a Python of the user's.
/// Without one, prints a message, or fails where it is required.
fn python() -> Option<&'static str> {
    let has = |python: &&str| {
        let tried = std::process::Command::new(python).args(["-c", "import numpy, PIL.Image"]).output();
        tried.is_ok_and(|output| output.status.success())
    };
    let found = ["python3", "/usr/bin/python3"].into_iter().find(has);
    if found.is_none() {
        assert!(std::env::var_os("LABELGS_REQUIRE_PYTHON").is_none(), "python3 with numpy and Pillow is required");
        eprintln!("skipped: there is no python3 with numpy and Pillow");
    }
    found
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

/// A scene, and the segmenter beside it.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    labelgs(folder.path(), "synth scene --preset simple --size 96x72 --views 12 --points 400");
    std::fs::write(folder.path().join("stub.py"), SEGMENTER).expect("written");
    folder
}

#[test]
fn photos_become_an_object_without_masks_by_hand() {
    let Some(_gpu) = crate::support::device() else { return };
    let Some(python) = python() else { return };
    let folder = place();
    let folder = folder.path();
    let output = segments(python, folder, &["scene", "-o", "segmented", "--with", "stub:segment"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("12/12"), "{}", text(&output.stdout));
    labelgs(folder, "train scene --iterations 100 -o plain");
    labelgs(folder, "masks repair segmented --per-view --model plain --scene scene -o masks");
    labelgs(folder, "label plain --scene scene --masks masks -o two.ply");
    labelgs(folder, "label plain --scene scene --masks segmented --per-view -o labelled.ply");
    let [two, one] = ["two.ply", "labelled.ply"].map(|name| std::fs::read(folder.join(name)).expect("a model"));
    assert!(two == one, "agreeing on the way gives the same labels as repaired masks");
    // Pixels of each true object, by the id that the repair gave them.
    let mut counts: BTreeMap<u16, BTreeMap<u16, u32>> = BTreeMap::new();
    let mut views = 0;
    for entry in std::fs::read_dir(folder.join("masks")).expect("masks").flatten() {
        let name = entry.file_name();
        if Path::new(&name).extension().is_some_and(|ending| ending == "png") {
            let [found, truth] =
                ["masks", "scene/masks"].map(|place| read_mask(folder.join(place).join(&name)).expect("ids"));
            truth
                .ids
                .iter()
                .zip(&found.ids)
                .for_each(|(&t, &f)| *counts.entry(t).or_default().entry(f).or_default() += 1);
            views += 1;
        }
    }
    assert!(views >= 10, "{views} masks");
    counts.remove(&0);
    let mut ids = Vec::new();
    for (object, found) in &counts {
        let (id, most) = found.iter().max_by_key(|(_, pixels)| **pixels).expect("pixels");
        let share = f64::from(*most) / f64::from(found.values().sum::<u32>());
        assert!(*id != 0 && share > 0.9, "object {object}: {found:?}");
        ids.push(*id);
    }
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), counts.len(), "objects stay apart: {counts:?}");
    labelgs(folder, &format!("extract labelled.ply --labels {} -o object.ply", ids[0]));
    let [all, object] =
        ["labelled.ply", "object.ply"].map(|name| read_model(folder.join(name)).expect("a model").gaussians);
    assert!(!object.is_empty() && object.len() < all.len() / 2, "{} of {} Gaussians", object.len(), all.len());
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
    assert!(said.contains("ids of each photo are its own") && said.contains(next), "{said}");
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

#[test]
fn the_help_of_the_segmenter_needs_no_packages() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/segment.py");
    let Ok(output) = std::process::Command::new("python3").arg("-S").arg(script).arg("--help").output() else { return };
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("--weights"), "{}", text(&output.stdout));
}

#[test]
fn a_segmenter_that_fails_is_told_with_the_remedy() {
    let Some(python) = python() else { return };
    let folder = place();
    let folder = folder.path();
    let refused = |flags: &[&str], expected: &[&str]| {
        let output = segments(python, folder, flags);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{flags:?}: {said}");
        assert!(said.starts_with("segment.py: ") && said.lines().count() == 1, "{said}");
        expected.iter().for_each(|part| assert!(said.contains(part), "{part}: {said}"));
    };
    let scene = ["scene", "-o", "out", "--with"];
    let with = |more: &[&'static str]| [&scene[..], more].concat();
    std::fs::write(folder.join("vit_h.pth"), b"no weights").expect("written");
    refused(&with(&["sam3"]), &["--with sam3: expected segment_anything"]);
    refused(&with(&["segment_anything"]), &["--weights is missing", "authors of segment_anything"]);
    refused(&with(&["sam2", "--weights", "x.pt"]), &["there is no file x.pt"]);
    refused(&with(&["mobile_sam", "--weights", "vit_h.pth"]), &["package mobile_sam cannot be imported", "install it"]);
    refused(&with(&["nothing:segment"]), &["package nothing cannot be imported"]);
    refused(&with(&["stub:nothing"]), &["stub has no function nothing"]);
    refused(&with(&["stub:number"]), &["stub has no function number"]);
    refused(&with(&["stub:wrong"]), &["000.png", "the shape (1, 1) and the photo (72, 96)"]);
    refused(&["scene/images", "-o", "out", "--with", "stub:ids"], &["has no photos in images"]);
    // Without the folders of packages.
    refused(
        &["-S", "scene", "-o", "out", "--with", "stub:ids"],
        &["package numpy cannot be imported", "python3-numpy"],
    );
    assert!(!folder.join("out").exists(), "nothing was written");
    // Ids of pictures come back as they are, in the order of their size; a second run has nothing to do.
    assert!(segments(python, folder, &with(&["stub:ids"])).status.success());
    let output = segments(python, folder, &with(&["stub:wrong"]));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let [found, truth] =
        ["out", "scene/masks"].map(|place| read_mask(folder.join(place).join("003.png")).expect("ids"));
    assert_eq!(found.objects().len(), truth.objects().len());
    assert!(found.ids.iter().zip(&truth.ids).all(|(a, b)| (*a == 0) == (*b == 0)));
}
