//! Masks of segmenters and annotation tools, in files as those tools write them. Broken files are refused with their
//! location.

use super::fixtures::*;
use super::forms::*;
use super::import::{auto, names, run, same_as_truth, sources};
use labelgs_masks::{Format, ImportOptions, ImportSummary, ObjectPer, Overlap, read_mask};
use png::{BitDepth, ColorType};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// A file that a tool wrote.
fn golden(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn per(done: &ImportSummary) -> ObjectPer {
    done.objects.as_ref().expect("masks of single objects").per
}

/// The folders of `amg.py`; the first mask surrounds the objects 1 and 2.
fn sam_folders(scene: &Scene) {
    for photo in 0..PHOTOS {
        let folder = format!("m/{}", name(photo));
        for (mask, inside) in [&[1, 2][..], &[2], &[3]].iter().enumerate() {
            let bytes: Vec<u8> = truth(photo).iter().map(|id| if inside.contains(id) { 255 } else { 0 }).collect();
            grey8(&scene.path().join(format!("{folder}/{mask}.png")), &bytes);
        }
        scene.write(&format!("{folder}/metadata.csv"), golden(&format!("sam/{}.csv", name(photo))));
    }
}

fn sam_lists(scene: &Scene) {
    (0..PHOTOS).for_each(|photo| {
        scene.write(&format!("m/{}.json", name(photo)), golden(&format!("sam/{}.json", name(photo))));
    });
}

#[test]
fn instances_of_coco_come_back() {
    let by_category = [Some("cup"), Some("bottle"), Some("big bowl")];
    let by_list = [Some("big bowl"), Some("bottle"), Some("cup")];
    let cases = [
        // COCO's own forms: polygons, lists of runs, and runs as text.
        ("coco.json", "m/instances_train.json", by_category, [1, 2, 3]),
        ("cvat.json", "m/annotations/instances_default.json", by_category, [1, 2, 3]),
        ("label-studio-coco.json", "m/result.json", by_list, [3, 2, 1]),
    ];
    for (file, place, expected, ids) in cases {
        let scene = scene();
        scene.write(place, golden(file));
        scene.photo("m/images/00.jpg", 12, 8);
        for source in ["m", place] {
            let done = auto(&scene, source).unwrap_or_else(|error| panic!("{file}: {error}"));
            assert_eq!(
                (done.format, names(&done), sources(&done)),
                (Format::Coco, expected.to_vec(), expected.to_vec())
            );
            assert_eq!((per(&done), done.overlaps.pixels), (ObjectPer::Name, 0));
            assert_eq!(done.source, scene.path().join(place));
            same_as_truth(&scene, &done, ids);
        }
        let each = run(&scene, "m", |options| options.object_per = ObjectPer::Mask).expect("imported");
        assert_eq!(per(&each), ObjectPer::Mask);
        assert_eq!(each.labels, auto(&scene, "m").expect("imported").labels);
    }
}

#[test]
fn tracks_are_objects_of_all_photos() {
    let scene = scene();
    scene.write("m/annotations/instances_default.json", golden("cvat-tracks.json"));
    let done = auto(&scene, "m").expect("imported");
    assert_eq!(names(&done), [Some("cup"), Some("cup 2"), Some("big bowl")]);
    assert_eq!(
        (sources(&done), per(&done)),
        (vec![Some("track 0"), Some("track 1"), Some("track 7")], ObjectPer::Track)
    );
    same_as_truth(&scene, &done, [1, 2, 3]);
    // Two cups in a photo: by mask, ids differ between photos; by name, the cups are one object.
    let each = run(&scene, "m", |options| options.object_per = ObjectPer::Mask).expect("imported");
    assert_eq!(sources(&each), [Some("cup"), Some("cup"), Some("big bowl")]);
    let one = run(&scene, "m", |options| options.object_per = ObjectPer::Name).expect("imported");
    assert_eq!((names(&one), one.overlaps.pixels), (vec![Some("cup"), Some("big bowl")], 0));
    assert_eq!(read_mask(scene.path().join("out/00.png")).expect("a mask").objects(), [1, 2]);
}

#[test]
fn masks_of_segment_anything_come_back_small_over_large() {
    for (write, format) in [(sam_folders as fn(&Scene), Format::SamFolders), (sam_lists, Format::SamJson)] {
        let scene = scene();
        write(&scene);
        let done = auto(&scene, "m").unwrap_or_else(|error| panic!("{format:?}: {error}"));
        assert_eq!((done.format, per(&done)), (format, ObjectPer::Mask));
        assert_eq!((names(&done), sources(&done)), (vec![None; 3], vec![None; 3]));
        assert_eq!((done.overlaps.rule, done.overlaps.photos), (Overlap::Smaller, PHOTOS));
        assert_eq!(done.overlaps.pixels, (0..PHOTOS).flat_map(truth).filter(|&id| id == 2).count() as u64);
        same_as_truth(&scene, &done, [1, 2, 3]);
        assert_eq!(run(&scene, "m", |o| o.format = format).expect("imported").labels, done.labels);
        let message = refusal(run(&scene, "m", |options| options.overlap = Overlap::Error));
        assert!(message.contains("of mask 1 and mask 2"), "{message}");
        let message = refusal(run(&scene, "m", |options| options.object_per = ObjectPer::Name));
        assert!(message.contains("15 of 15 masks have no name; set `object_per = mask`"), "{message}");
    }
    // A photo of the data set SA-1B has a description besides its masks.
    let scene = scene();
    let masks: Value = serde_json::from_slice(&golden("sam/00.json")).expect("JSON");
    scene.write("m/00.json", json!({"image": {"file_name": "00.jpg"}, "annotations": masks}).to_string());
    assert_eq!(auto(&scene, "m").expect("imported").masks, 1);
}

/// Unsupported forms of a tool are named together with the export that can be read.
#[test]
fn other_exports_of_tools_are_named_with_a_cure() {
    for (file, tool) in [
        ("m/labelmap.txt", "CVAT"),
        ("m/SegmentationObject/00.png", "CVAT"),
        ("m/task-41-annotation-7-by-a@b.org-tag-cup-0.png", "Label Studio"),
    ] {
        let scene = scene();
        scene.photo(file, 12, 8);
        let message = refusal(auto(&scene, "m"));
        assert!(message.contains(tool) && message.contains("as COCO 1.0"), "{message}");
    }
}

#[test]
fn a_crowd_yields_and_later_annotations_win() {
    let scene = scene();
    let all = |from: u32, to: u32| json!([[from, 0, to, 0, to, 8, from, 8]]);
    let annotation = |id: u32, crowd: u32, category: u32, shape: Value| json!({"id": id, "image_id": 1, "category_id": category, "iscrowd": crowd, "segmentation": shape});
    let list = [
        annotation(1, 0, 1, all(0, 6)),
        annotation(2, 0, 2, all(4, 8)),
        annotation(3, 1, 3, all(2, 12)),
        annotation(4, 0, 2, json!([])),
    ];
    let categories = ["a", "b", "many"].iter().zip(1..).map(|(name, id)| json!({"id": id, "name": name}));
    let file = json!({"images": [{"id": 1, "file_name": "00.png", "width": 24, "height": 16}, {"id": 2, "file_name": "x.png"}],
        "annotations": list, "categories": categories.collect::<Vec<_>>()});
    scene.write("a.json", file.to_string());
    // The outlines belong to an image of twice the size, so half of each remains.
    let row = |rule| {
        let done = run(&scene, "a.json", |options| options.overlap = rule).expect("imported");
        assert!(done.notes.iter().any(|note| note.contains("1 of 4 annotations")), "{:?}", done.notes);
        read_mask(scene.path().join("out/00.png")).expect("a mask").ids[..7].to_vec()
    };
    assert_eq!(row(Overlap::Auto), [1, 1, 2, 2, 3, 3, 0]);
    assert_eq!(row(Overlap::Later), row(Overlap::Auto));
    assert_eq!(row(Overlap::Smaller), [1, 1, 2, 2, 3, 3, 0]);
    let message = refusal(run(&scene, "a.json", |options| options.overlap = Overlap::Error));
    assert!(message.contains("a and b") || message.contains("many"), "{message}");
}

/// A COCO file with one change, and the expected message.
#[test]
fn each_broken_file_of_coco_has_its_message() {
    let whole: Value = serde_json::from_slice(&golden("coco.json")).expect("JSON");
    let refused = |change: &dyn Fn(&mut Value), expected: &[&str]| {
        let scene = scene();
        let mut value = whole.clone();
        change(&mut value);
        scene.write("a.json", value.to_string());
        let message = refusal(auto(&scene, "a.json"));
        assert!(message.contains("a.json"), "{message}");
        expected.iter().for_each(|part| assert!(message.contains(part), "{part}: {message}"));
        assert!(!scene.path().join("out").exists(), "nothing is written");
    };
    let put =
        |path: &'static str, new: Value| move |value: &mut Value| *value.pointer_mut(path).expect(path) = new.clone();
    let first = "annotation 1768 (photo 00.png)";
    refused(&put("/annotations/0/segmentation", json!([[1, 2, 3, 4]])), &[first, "polygon 1 has 4 numbers"]);
    refused(&put("/annotations/0/segmentation", json!([[1, 2, "x", 4, 5, 6]])), &[first, "not a list of numbers"]);
    refused(&put("/annotations/0/segmentation", json!([[1, 2, 1e9, 4, 5, 6]])), &[first, "the coordinate 1000000000"]);
    refused(
        &put("/annotations/1/segmentation/counts", json!([1])),
        &["annotation 1769", "add up to 1, but 12 x 8 px are 96"],
    );
    refused(&put("/annotations/1/segmentation/size", json!([8])), &["annotation 1769", "`size`", "expected {\"size\""]);
    refused(&put("/annotations/2/segmentation/counts", json!("1~")), &["annotation 1770", "character 2"]);
    refused(
        &put("/annotations/2/segmentation", json!({"size": [8, 8], "counts": [64]})),
        &["annotation 1770", "8 x 8 px"],
    );
    refused(&put("/annotations/3/image_id", json!(5)), &["annotation 1771", "of image 5", "does not list"]);
    refused(&put("/images/1/file_name", json!("00.jpg")), &["image `00.jpg`", "both belong to the photo 00.png"]);
    refused(&put("/images/1/id", json!(397_133)), &["image `01.png`", "unique"]);
    refused(&put("/images/0/width", json!(8)), &[first, "the image has 8 x 8 px"]);
    refused(&put("/images/0/width", json!(0)), &[first, "the image has 0 x 8 px"]);
    refused(&put("/images", json!([])), &["annotation 1768", "does not list"]);
    refused(&put("/images", json!(3)), &["line 1", "expected instances of COCO"]);
    refused(&put("/annotations", json!([])), &["no mask belongs to a photo"]);
    let renamed = |value: &mut Value| {
        let images = value["images"].as_array_mut().expect("a list");
        images.iter_mut().enumerate().for_each(|(at, image)| image["file_name"] = json!(format!("other{at}.png")));
    };
    refused(&renamed, &["the scene has 00.png", "the masks are for other0.png"]);
    let boxes = |value: &mut Value| {
        let list = value["annotations"].as_array_mut().expect("a list");
        list.iter_mut().for_each(|annotation| annotation["segmentation"] = json!([]));
    };
    refused(&boxes, &["none of the 15 annotations", "export polygons or masks"]);
}

#[test]
fn files_that_are_no_coco_or_several_are_refused() {
    let scene = scene();
    let at = |name: &str, text: &[u8]| scene.write(name, text);
    at("a.json", b"{\"images\": [");
    assert!(refusal(auto(&scene, "a.json")).contains("a.json: line 1"));
    at("a.json", b"\xff");
    assert!(refusal(auto(&scene, "a.json")).contains("UTF-8"));
    at("two/a.json", &golden("coco.json"));
    at("two/annotations/b.json", &golden("cvat.json"));
    let message = refusal(auto(&scene, "two"));
    assert!(message.contains("name one of them") && message.contains("b.json"), "{message}");
    at("none/readme.txt", b"x");
    let coco = |options: &mut ImportOptions| options.format = Format::Coco;
    assert!(refusal(run(&scene, "none", coco)).contains("has no JSON with images and annotations"));
    assert!(refusal(run(&scene, "a.json", |o| o.format = Format::SamJson)).contains("name the folder"));
    // Files of two tools.
    at("both/a.json", &golden("coco.json"));
    at("both/00.json", &golden("sam/00.json"));
    let message = refusal(auto(&scene, "both"));
    assert!(message.contains("`format = sam-json`") && message.contains("`format = coco`"), "{message}");
    assert_eq!(run(&scene, "both", coco).expect("imported").format, Format::Coco);
}

#[test]
fn each_broken_folder_of_a_tool_has_its_message() {
    let refused = |write: fn(&Scene), change: &dyn Fn(&Scene), expected: &[&str]| {
        let scene = scene();
        write(&scene);
        change(&scene);
        let message = refusal(auto(&scene, "m"));
        expected.iter().for_each(|part| assert!(message.contains(part), "{part}: {message}"));
        assert!(!scene.path().join("out").exists(), "nothing is written");
    };
    let put = |name: &'static str, text: &'static str| move |scene: &Scene| drop(scene.write(name, text));
    let gone = |name: &'static str| move |scene: &Scene| fs::remove_file(scene.path().join(name)).expect("removed");
    refused(sam_folders, &gone("m/01/2.png"), &["01/metadata.csv: line 4", "01/2.png is missing"]);
    refused(sam_folders, &put("m/01/metadata.csv", "area\n"), &["01/metadata.csv: line 1", "`id,area`"]);
    refused(sam_folders, &put("m/01/metadata.csv", "id,area\nx,1\n"), &["line 2: begins with `x`"]);
    refused(sam_folders, &put("m/01/metadata.csv", "id,area\n0,1\n0,1\n"), &["line 3: begins with `0`"]);
    refused(sam_folders, &put("m/01/metadata.csv", "id,area\n0,1\n"), &["does not list 01/1.png"]);
    refused(sam_folders, &put("m/01/1.png", "x"), &["01/1.png", "not a readable PNG"]);
    refused(sam_lists, &put("m/01.json", "[{\"segmentation\": "), &["01.json: line 1", "amg.py"]);
    refused(sam_lists, &put("m/01.json", "[{\"area\": 1}]"), &["01.json: is not a list of masks"]);
    let cut = "[{\"segmentation\": {\"size\": [8, 12], \"counts\": [5]}}]";
    refused(sam_lists, &put("m/01.json", cut), &["01.json: mask 0", "add up to 5"]);
    let other = "[{\"segmentation\": {\"size\": [8, 8], \"counts\": [64]}}]";
    refused(sam_lists, &put("m/01.json", other), &["01.json: mask 0", "its photo 01.png 12 x 8 px"]);
}

#[test]
fn rules_of_objects_need_masks_of_one_object() {
    let scene = scene();
    id_pictures(&scene.path().join("m"), ColorType::Grayscale, BitDepth::Eight, [1, 2, 3]);
    let error = run(&scene, "m", |options| options.object_per = ObjectPer::Name).expect_err("refused");
    assert!(error.to_string().starts_with("object_per:"), "{error}");
    binary(255, &[1, 2], |object, photo| scene.path().join(format!("b/{}/{object}.png", name(photo))));
    let done = run(&scene, "b", |options| options.object_per = ObjectPer::Mask).expect("imported");
    assert_eq!((per(&done), names(&done)), (ObjectPer::Mask, vec![Some("1"), Some("2")]));
    let message = refusal(run(&scene, "b", |options| options.object_per = ObjectPer::Track));
    assert!(message.contains("10 of 10 masks have no track"), "{message}");
}
