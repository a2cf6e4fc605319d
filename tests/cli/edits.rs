//! The verbs that choose and edit labels: names, files beside models, places in views, near planes.

use assert_cmd::Command;
use glam::DVec3;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::cli::support::scene::near_plane;
use labelgs::files::{LabelEntry, LabelTable, run_folder};
use labelgs::formats::{read_model, write_model};
use labelgs::masks::read_mask;
use labelgs::scene::Gaussians;
use labelgs::synth::{SynthOptions, ring_of_cameras};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Output;

/// Runs the program without the validation layer.
pub fn labelgs(args: &[&str]) -> Output {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    command.env("LABELGS_VALIDATION", "off").args(args).output().expect("it runs")
}

/// The JSON of a command that succeeds.
#[track_caller]
pub fn succeeds(args: &[&str]) -> Value {
    let output = labelgs(&[args, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON alone on standard output")
}

/// The message of a command that ends with this status.
#[track_caller]
pub fn refused_with(args: &[&str], status: i32) -> String {
    let output = labelgs(args);
    assert_eq!(output.status.code(), Some(status), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn refused(args: &[&str]) -> String {
    refused_with(args, 2)
}

/// Opaque balls at these places, one label each from 1.
fn balls(path: &Path, places: &[[f32; 3]], labels: &[u32]) {
    let count = places.len();
    let gaussians = Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: places.to_vec(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: vec![[0.15_f32.ln(); 3]; count],
        opacities: vec![6.0; count],
        sh0: vec![[0.5; 3]; count],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some(labels.to_vec()),
        label_confidence: None,
    };
    write_model(path, &gaussians).expect("written");
}

fn labels_of(path: &Path) -> Vec<u32> {
    read_model(path).expect("PLY").gaussians.labels.expect("labels")
}

/// A model with the labels 0, 1 cup, 1, 3 spoon, 3, 3, and its table.
fn model(folder: &Path) -> PathBuf {
    let path = folder.join("model.ply");
    let places = [0.0, 1.0, 1.2, 3.0, 3.2, 9.0].map(|x| [x, 0.0, 0.0]);
    balls(&path, &places, &[0, 1, 1, 3, 3, 3]);
    table().write(&LabelTable::path_beside(&path)).expect("written");
    path
}

fn table() -> LabelTable {
    let entry = |id, name: &str| LabelEntry { name: Some(name.into()), ..LabelEntry::new(id) };
    LabelTable::new(vec![entry(1, "cup"), entry(3, "spoon")])
}

fn names(path: &Path) -> Vec<(u32, String)> {
    let table = LabelTable::read(path).expect("table");
    table.labels.into_iter().map(|entry| (entry.id, entry.name.unwrap_or_default())).collect()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn names_choose_labels_and_go_with_them() {
    let folder = tempfile::tempdir().expect("folder");
    let (model, out) = (model(folder.path()), folder.path().join("out.ply"));
    let beside = folder.path().join("out.labels.json");
    for choice in [["--labels", "Spoon"], ["--name", "spoon"], ["--labels", "3"]] {
        let result = succeeds(&["extract", text(&model), choice[0], choice[1], "-o", text(&out)]);
        assert_eq!((&result["labels"], &result["gaussians"], &result["of"]), (&json!([3]), &3.into(), &6.into()));
        assert_eq!(names(&beside), [(3, "spoon".to_owned())]);
    }
    succeeds(&["remove", text(&model), "--labels", "spoon,0", "-o", text(&out)]);
    assert_eq!((labels_of(&out), names(&beside)), (vec![1, 1], vec![(1, "cup".to_owned())]));
    let message = refused(&["extract", text(&model), "--name", "fork", "-o", text(&out)]);
    assert!(message.contains("--name: no label is named fork; the model has 1 cup, 3 spoon"), "{message}");
    let listed = succeeds(&["list", text(&model)]);
    assert_eq!((&listed["labels"][1]["name"], &listed["labels"][0]["name"]), (&"cup".into(), &Value::Null));

    // A table other than the one beside the model.
    let other = folder.path().join("other.json");
    LabelTable::new(vec![LabelEntry { name: Some("ladle".into()), ..LabelEntry::new(3) }]).write(&other).expect("ok");
    let args = ["recolour", text(&model), "--labels", "ladle", "--label-table", text(&other)];
    let result = succeeds(&[&args[..], &["--colour", "1,0,0", "-o", text(&out)]].concat());
    assert_eq!(result["recoloured"], 3);
    let painted = read_model(&out).expect("PLY").gaussians;
    assert!(painted.sh0[0] == [0.5; 3] && (painted.sh0[4][0] - 1.772_454).abs() < 1e-5, "{:?}", painted.sh0);
    assert_eq!(names(&beside), [(3, "ladle".to_owned())]);

    // Writing a model without names removes the names of an earlier model.
    std::fs::remove_file(LabelTable::path_beside(&model)).expect("removed");
    succeeds(&["extract", text(&model), "--labels", "1", "-o", text(&out)]);
    assert!(!beside.exists());
}

#[test]
fn labels_return_to_a_copy_from_another_program() {
    let folder = tempfile::tempdir().expect("folder");
    let (model, out) = (model(folder.path()), folder.path().join("out.ply"));
    let (copy, beside) = (folder.path().join("copy.spz"), folder.path().join("out.labels.json"));
    // Without the spoon but for one Gaussian, backwards, rounded by the format, and one more from elsewhere.
    let whole = read_model(&model).expect("PLY").gaussians;
    let mut edited = Gaussians { labels: None, ..whole.picked(&[4, 2, 1, 0, 0]) };
    edited.means[4] = [0.0, 50.0, 0.0];
    write_model(&copy, &edited).expect("written");
    let result = succeeds(&["label", text(&copy), "--like", text(&model), "-o", text(&out)]);
    assert_eq!((&result["gaussians"], &result["none"]), (&5.into(), &1.into()), "{result}");
    assert_eq!(result["same"].as_u64().zip(result["near"].as_u64()).map(|(same, near)| same + near), Some(4));
    assert_eq!(labels_of(&out), [3, 1, 1, 0, 0]);
    assert_eq!(names(&beside), [(1, "cup".to_owned()), (3, "spoon".to_owned())]);

    edited.means.iter_mut().for_each(|mean| mean[2] += 30.0);
    write_model(&copy, &edited).expect("written");
    let message = refused(&["label", text(&copy), "--like", text(&model), "-o", text(&out)]);
    assert!(message.contains("--like: only 0 of 5 Gaussians") && message.contains("looks moved"), "{message}");
    let message = refused_with(&["label", text(&model), "--like", text(&copy), "-o", text(&out)], 3);
    assert!(message.contains("copy.spz: the model has no labels"), "{message}");
}

#[test]
fn labels_are_renumbered_merged_and_split() {
    let folder = tempfile::tempdir().expect("folder");
    let (model, out) = (model(folder.path()), folder.path().join("out.ply"));
    let beside = folder.path().join("out.labels.json");
    let (from, to) = (text(&model), text(&out));
    succeeds(&["relabel", from, "--map", "3=7,1=0", "-o", to]);
    assert_eq!((labels_of(&out), names(&beside)), (vec![0, 0, 0, 7, 7, 7], vec![(7, "spoon".to_owned())]));
    assert!(refused(&["relabel", from, "--map", "2=4", "-o", to]).contains("no Gaussian has label 2"));
    assert!(refused(&["relabel", from, "--map", "3", "-o", to]).contains("OLD=NEW"));

    succeeds(&["merge", from, "--labels", "cup,3", "-o", to]);
    assert_eq!((labels_of(&out), names(&beside)), (vec![0, 1, 1, 1, 1, 1], vec![(1, "cup".to_owned())]));
    succeeds(&["merge", from, "--labels", "1,3", "--into", "3", "--name", "set", "-o", to]);
    assert_eq!((labels_of(&out), names(&beside)), (vec![0, 3, 3, 3, 3, 3], vec![(3, "set".to_owned())]));
    assert!(
        refused(&["merge", from, "--labels", "1", "--into", "3", "-o", to])
            .contains("label 3 spoon is not one of them")
    );
    assert!(refused(&["merge", from, "--labels", "1", "--name", "spoon", "-o", to]).contains("name of label 3"));

    let split = ["split-components", from, "--labels", "spoon", "-o", to];
    let result = succeeds(&split);
    assert_eq!((&result["parts"], &result["specks"]), (&json!({"3": [3, 4]}), &0.into()));
    assert_eq!(labels_of(&out), [0, 1, 1, 3, 3, 4]);
    assert_eq!(names(&beside)[2], (4, "spoon 2".to_owned()));
    let small = ["--min-share", "0.4", "--specks", "drop"];
    assert_eq!(succeeds(&[&split[..], &small].concat())["specks"], 1);
    assert_eq!(labels_of(&out), [0, 1, 1, 3, 3]);
    succeeds(&[&split[..], &["--gap", "6"]].concat());
    assert_eq!(labels_of(&out), [0, 1, 1, 3, 3, 3], "a wide gap holds all together");
    let result = succeeds(&["extract", from, "--labels", "3", "--drop-specks", "--min-share", "0.4", "-o", to]);
    assert_eq!((&result["specks"], labels_of(&out)), (&1.into(), vec![3, 3]));
}

#[test]
fn the_near_plane_is_that_of_the_run() {
    let folder = tempfile::tempdir().expect("folder");
    let run = folder.path().join("run");
    let ply = run.join("point_cloud/iteration_5/point_cloud.ply");
    balls(&ply, &[[0.0; 3]], &[1]);
    assert_eq!(near_plane(&run, None).expect("default"), 0.2);
    std::fs::write(run.join(run_folder::CONFIG_FILE), "near = 0.01\nsome_later_field = 3\n").expect("file");
    assert_eq!(near_plane(&run, None).expect("of the run"), 0.01);
    assert_eq!(near_plane(&ply, None).expect("of the run"), 0.01);
    assert_eq!(near_plane(&ply, Some(0.5)).expect("typed"), 0.5);
    let bare = folder.path().join("bare.ply");
    balls(&bare, &[[0.0; 3]], &[1]);
    assert_eq!(near_plane(&bare, None).expect("default"), 0.2);
    assert_eq!(run_folder::find_for_model(&run.join("a/b/c.ply")), None, "only models of steps are in a run");
    std::fs::write(run.join(run_folder::CONFIG_FILE), "near = -1\n").expect("file");
    let error = near_plane(&run, None).expect_err("negative");
    assert!(exit_status(&error) == 3 && error.to_string().contains("near"), "{error}");
}

#[test]
fn places_in_views_choose_labels() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let scene = folder.path().join("scene");
    let scene = text(&scene);
    succeeds(&["synth", scene, "--preset", "simple", "--size", "96x72", "--views", "4", "--points", "20"]);
    let cameras =
        ring_of_cameras(&SynthOptions { width: 96, height: 72, views: 4, points: 20, ..SynthOptions::default() });
    let places = [[-0.6, -0.5, 0.4], [0.5, 0.7, 0.4], [0.0, 0.0, 1.3]];
    // The model lies in the folder of a run, so the near plane of that run applies.
    let run = folder.path().join("run");
    let ply = run.join("point_cloud/iteration_1/point_cloud.ply");
    balls(&ply, &places, &[1, 3, 4]);
    table().write(&run.join("labels.json")).expect("written");
    let (run_path, out) = (text(&run), folder.path().join("out.ply"));
    let pixel = |view: usize, ball: usize| {
        let camera = &cameras[view];
        let place = camera.project(camera.to_camera(DVec3::from_array(places[ball].map(f64::from))));
        (place.x as u32, place.y as u32)
    };
    let at = |view: usize, ball: usize| {
        let (x, y) = pixel(view, ball);
        format!("{view:03}:{x},{y}")
    };
    let extract = |choice: &[&str]| {
        let args = ["extract", run_path, "--scene", scene, "-o", text(&out)];
        succeeds(&[&args[..], choice].concat())["labels"].clone()
    };
    assert_eq!(extract(&["--at", &at(0, 0)]), json!([1]));
    assert_eq!(names(&LabelTable::path_beside(&out)), [(1, "cup".to_owned())]);
    assert_eq!(extract(&["--at", &at(1, 2), "--at", &at(3, 1), "--name", "cup"]), json!([1, 3, 4]));
    assert_eq!(extract(&["--labels", "1,3", "--at", &at(1, 2), "--not-at", &at(2, 1)]), json!([1, 4]));
    let (x, y) = pixel(0, 2);
    let around = format!("000:{},{},{},{}", x.saturating_sub(9), y.saturating_sub(9), x + 10, y + 10);
    assert_eq!(extract(&["--box", &around]), json!([4]));
    // Half the size, half the coordinates.
    let half = format!("000:{},{}", x / 2, y / 2);
    assert_eq!(extract(&["--at", &half, "--max-resolution", "48"]), json!([4]));

    let message = refused(&["remove", run_path, "--scene", scene, "-o", text(&out), "--at", "000:0,71"]);
    assert!(message.contains("--at: no label is at 0,71; the view shows "), "{message}");
    assert!(message.contains("1 cup (") && message.contains("3 spoon ("), "{message}");
    assert!(refused(&["remove", run_path, "-o", text(&out), "--at", "000:1,1"]).contains("--scene"));

    let pictures = folder.path().join("pictures");
    let render = ["render", run_path, "--scene", scene, "--views", "000", "--what", "labels", "-o", text(&pictures)];
    let map = || read_mask(pictures.join("000.labels.png")).expect("map").objects();
    succeeds(&[&render[..], &["--only", "--at", &at(0, 2)]].concat());
    assert_eq!(map(), [4]);
    succeeds(&[&render[..], &["--without", "cup", "--at", &at(0, 2)]].concat());
    assert_eq!(map(), [3]);
    assert!(refused(&[&render[..], &["--at", &at(0, 2)]].concat()).contains("--without is needed"));

    // The near plane of the run is behind the scene: nothing is drawn, unless `--near` overrides it.
    std::fs::write(run.join(run_folder::CONFIG_FILE), "near = 50.0\n").expect("file");
    succeeds(&render);
    assert_eq!(map(), Vec::<u16>::new());
    succeeds(&[&render[..], &["--near", "0.1"]].concat());
    assert_eq!(map(), [1, 3, 4]);
    assert!(
        refused(&["extract", run_path, "--scene", scene, "-o", text(&out), "--at", &at(0, 0)]).contains("no label")
    );
    let eval = ["eval", run_path, "--scene", scene, "--views", "000"];
    let psnr = |more: &[&str]| {
        let output = labelgs(&[&eval[..], more, &["--json"]].concat());
        let scores: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        scores["mean"]["psnr"].as_f64().expect("a number")
    };
    assert_ne!(psnr(&[]), psnr(&["--near", "0.2"]));
}

/// `convert` keeps labels and names in every format that is written, and any command reads them.
#[test]
fn a_model_is_converted_by_the_ending() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = model(folder.path());
    let at = |name: &str| folder.path().join(name).display().to_string();
    for name in ["a.spz", "a.glb", "a.sog", "b.ply"] {
        let result = succeeds(&["convert", &source.display().to_string(), &at(name)]);
        assert_eq!((&result["gaussians"], &result["of"], &result["labels"]), (&6.into(), &6.into(), &json!([1, 3])));
        // The names are in the file itself, unless it is a PLY.
        if !name.ends_with(".ply") {
            std::fs::remove_file(LabelTable::path_beside(Path::new(&at(name)))).expect("removed");
        }
        let part = at(&format!("part.{name}"));
        succeeds(&["extract", &at(name), "--labels", "spoon", "-o", &part]);
        assert_eq!(labels_of(Path::new(&part)), [3, 3, 3], "{name}");
        assert_eq!(LabelTable::read(&LabelTable::path_beside(Path::new(&part))).expect("names").labels.len(), 1);
    }
    let other = ["convert", &at("model.ply"), &at("v4.spz"), "--spz-version", "4", "--label-type", "none"];
    succeeds(&other);
    assert!(read_model(at("v4.spz")).expect("SPZ").gaussians.labels.is_none());
    assert!(refused(&["convert", &at("model.ply"), &at("a.splat")]).contains(".splat files can only be read"));
}

/// A file for each label, which together are the whole.
#[test]
fn objects_are_converted_into_a_file_each() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = model(folder.path());
    let out = folder.path().join("parts/o.ply");
    let result = succeeds(&["convert", &source.display().to_string(), &out.display().to_string(), "--per-object"]);
    let files: Vec<PathBuf> =
        ["o_000_none.ply", "o_001_cup.ply", "o_003_spoon.ply"].map(|name| out.with_file_name(name)).to_vec();
    let listed = result["files"].as_array().expect("files");
    assert_eq!(
        listed.iter().map(|file| file["output"].clone()).collect::<Vec<_>>(),
        files.iter().map(|path| json!(path)).collect::<Vec<_>>()
    );
    let labels: Vec<u32> = files.iter().flat_map(|path| labels_of(path)).collect();
    assert_eq!(labels, [0, 1, 1, 3, 3, 3]);
    assert!(!out.exists());
}

#[test]
fn models_are_cleaned_and_transformed_with_their_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = model(folder.path()).display().to_string();
    let out = folder.path().join("out.ply");
    let to = out.display().to_string();
    let result = succeeds(&["clean", &source, "--inside", "-0.5,-1,-1,3.1,1,1", "-o", &to]);
    assert_eq!((&result["dropped"]["outside"], labels_of(&out)), (&2.into(), vec![0, 1, 1, 3]));
    let names = || LabelTable::read(&LabelTable::path_beside(&out)).expect("names");
    assert_eq!(names(), table());
    let result = succeeds(&["transform", &source, "--up", "-x", "--scale", "2", "--origin", "1,0,0", "-o", &to]);
    assert_eq!((&result["scale"], names()), (&2.0.into(), table()));
    let after = read_model(&out).expect("PLY").gaussians;
    assert!(after.world(5).distance(DVec3::new(0.0, 16.0, 0.0)) < 1e-5, "{}", after.world(5));
    for args in [&["clean", &source, "-o", &to] as &[&str], &["transform", &source, "-o", &to]] {
        refused(args);
    }
    for (flag, value) in [("--up", "0,0,0"), ("--up", "w"), ("--scale", "0"), ("--origin", "1,2")] {
        refused(&["transform", &source, flag, value, "-o", &to]);
    }
    refused(&["clean", &source, "--inside", "0,0,0,-1,1,1", "-o", &to]);
}

/// A wrong extension is refused before anything is read: the model here does not exist.
#[test]
fn nothing_is_written_under_a_wrong_extension() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (none, out) = (at("none.ply"), at("x.obj"));
    let labels = ["--labels", "1", "-o", &out];
    let commands: [&[&str]; 11] = [
        &[&["extract", none.as_str()] as &[&str], &labels].concat(),
        &[&["remove", none.as_str()] as &[&str], &labels].concat(),
        &[&["merge", none.as_str()] as &[&str], &labels].concat(),
        &[&["split-components", none.as_str()] as &[&str], &labels].concat(),
        &[&["recolour", none.as_str(), "--colour", "black"] as &[&str], &labels].concat(),
        &["relabel", &none, "--map", "1=2", "-o", &out],
        &["clean", &none, "--max-size", "1", "-o", &out],
        &["transform", &none, "--up", "z", "-o", &out],
        &["convert", &none, &out],
        &["simplify", &none, "--scene", &none, "--gaussians", "5", "-o", &out],
        &["label", &none, "--scene", &none, "--masks", &none, "-o", &out],
    ];
    for args in commands {
        let message = refused(args);
        assert!(message.contains(".obj is not a model extension") && message.contains(".ply, .spz"), "{message}");
    }
    assert!(refused(&["convert", &none, &at("x.splat")]).contains("can only be read"));
    let message = refused(&["occlusion", &none, "--masks", &none, "--model", &none, "-o", &at("x.ply")]);
    assert!(message.contains("expected the extension .json"), "{message}");
    assert!(refused(&["report", &none, "-o", &at("x.png")]).contains("extension .html"));
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}
