//! Broken inputs and their messages, without a device.

use super::{Columns, columns_file, layout, message, run_on};
use assert_cmd::Command;
use labelgs::eval::protocol::{Protocol, SelectBy};
use labelgs::files::{LabelEntry, LabelTable};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use std::path::Path;
use tempfile::tempdir;

#[test]
fn folders_without_the_layout_say_what_is_expected() {
    let folder = tempdir().expect("folder");
    let truth = folder.path();
    let says = |protocol, expected: &str| {
        let text = message(layout(protocol, truth, "fern", SelectBy::Prompt));
        assert!(text.contains(expected), "{text}");
    };
    says(Protocol::Labelgs, "FRAME/OBJECT.png");
    says(Protocol::LerfMask, "VIEW/PROMPT.png");
    says(Protocol::ThreeDOvs, "no classes.txt");
    says(Protocol::Nvos, "masks/fern/FRAME_mask.png");
    says(Protocol::Binary, "OBJECT/FRAME.png");
    assert!(
        message(layout(Protocol::Binary, &truth.join("nowhere"), "fern", SelectBy::Name)).contains("no such folder")
    );
    columns_file(&truth.join("masks/a/x_mask.png"), 0..1);
    columns_file(&truth.join("masks/b/x_mask.png"), 0..1);
    says(Protocol::Nvos, "a, b");
    columns_file(&truth.join("one/x/cup.png"), 0..1);
    let text = message(layout(Protocol::Labelgs, &truth.join("one"), "fern", SelectBy::Prompt));
    assert!(text.contains("first frame is the prompt"), "{text}");
}

#[test]
fn the_truth_of_another_scene_is_refused() {
    let folder = tempdir().expect("folder");
    columns_file(&folder.path().join("x/cup.png"), 0..1);
    columns_file(&folder.path().join("y/cup.png"), 0..1);
    let how = (Protocol::Labelgs, false, SelectBy::Prompt);
    let text = message(run_on(how, folder.path(), (&["a.jpg"], 0), &[], Columns::new([1; 8])));
    assert!(text.contains("such as y") && text.contains("a.jpg"), "{text}");
}

fn eval(args: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    let nowhere = "/nonexistent/driver.json";
    command.env("VK_DRIVER_FILES", nowhere).env("VK_ICD_FILENAMES", nowhere).env_remove("LABELGS_DEVICE");
    let output = command.arg("benchmark").args(args).output().expect("it runs");
    (output.status.code().expect("a status"), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn the_command_line_refuses_before_a_device_is_needed() {
    let folder = tempdir().expect("folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (model, truth, scene) = (path("model.ply"), path("truth"), path("scene"));
    let gaussians = Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: vec![[0.0; 3]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]],
        scales: vec![[0.0; 3]],
        opacities: vec![0.0],
        sh0: vec![[0.0; 3]],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some(vec![3]),
        label_confidence: None,
    };
    write_model(Path::new(&model), &gaussians).expect("written");
    let with = |more: &[&str]| eval(&[&[&model[..], "--scene", &scene, "--truth", &truth], more].concat());
    let says = |more: &[&str], status: i32, expected: &str| {
        let (found, text) = with(more);
        assert!(found == status && text.contains(expected), "{more:?}: {found} {text}");
    };
    says(&["--protocol", "labelgs"], 3, "no such folder of true masks");
    columns_file(&Path::new(&truth).join("a/cup.png"), 0..1);
    columns_file(&Path::new(&truth).join("b/cup.png"), 0..1);
    says(&["--protocol", "3d-ovs"], 3, "classes.txt");
    says(&["--protocol", "nvos", "--compat"], 2, "there is no published scorer of nvos");
    says(&["--protocol", "labelgs", "--objects", "cup,mug"], 2, "no object mug; it has cup");
    says(&["--protocol", "lerf-mask"], 3, "no labels.json");
    let entry = LabelEntry { name: Some("spoon".into()), ..LabelEntry::new(3) };
    LabelTable::new(vec![entry]).write(&LabelTable::path_beside(Path::new(&model))).expect("written");
    says(&["--protocol", "lerf-mask"], 3, "contains no object of the benchmark (cup); its names are spoon");
    says(&["--protocol", "lerf-mask", "--by", "prompt"], 3, "scene");
    says(&["--protocol", "labelgs", "--masks", "m"], 2, "--masks");
}
