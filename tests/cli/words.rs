//! What is typed as hands type it, and what the terminal answers: flags that the command has, nearest names, counts.

use assert_cmd::Command;
use clap::Parser;
use labelgs::cli::command::{Cli, Command as Verb};
use labelgs::files::{LabelEntry, LabelTable};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use serde_json::json;
use std::path::Path;

/// Runs a command that ends with `status`, and returns its messages.
#[track_caller]
fn said(args: &[&str], status: i32) -> String {
    let output = Command::cargo_bin("labelgs").expect("the tool is built").args(args).output().expect("it runs");
    let text = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(status), "{args:?}: {text}");
    text
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A model with a Gaussian for each label from 1 to `count`.
fn model(path: &Path, count: u32) {
    let rows = count as usize;
    let gaussians = Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: (0..rows).map(|row| [row as f32, 0.0, 1.0]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; rows],
        scales: vec![[-3.0; 3]; rows],
        opacities: vec![0.0; rows],
        sh0: vec![[0.5; 3]; rows],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some((1..=count).collect()),
        label_confidence: None,
    };
    write_model(path, &gaussians).expect("written");
}

#[test]
fn a_message_names_a_flag_only_if_the_command_has_it() {
    let folder = tempfile::tempdir().expect("folder");
    let plan = said(&["plan", "--gaussians", "900M", "--card", "8G"], 5);
    assert!(plan.contains("lower --gaussians"), "{plan}");
    for other in ["max-gaussians", "max-resolution", "label samples", "`"] {
        assert!(!plan.contains(other), "{other}: {plan}");
    }
    let plan = said(&["plan", "--gaussians", "10", "--size", "16384x16384", "--card", "1G"], 5);
    assert!(plan.contains("lower --size or use another device"), "{plan}");

    // A key of a file is no flag, although another command has one of that name.
    let scene = folder.path().join("scene");
    said(&["-q", "synth", text(&scene), "--preset", "simple", "--size", "32x24", "--views", "3"], 0);
    let coco = folder.path().join("coco.json");
    let file = json!({
        "images": [{"id": 1, "file_name": "000.png", "width": 32, "height": 24}],
        "categories": [{"id": 1, "name": "cup"}],
        "annotations": [{"id": 7, "image_id": 1, "category_id": 1, "segmentation": {"counts": [768]}}],
    });
    std::fs::write(&coco, file.to_string()).expect("written");
    let masks = folder.path().join("masks");
    let import = said(&["masks", "import", text(&coco), "--scene", text(&scene), "-o", text(&masks)], 3);
    assert!(import.contains("size") && !import.contains("--size"), "{import}");

    // The flags of the training.
    let out = folder.path().join("out");
    let train =
        said(&["train", text(&scene), "-o", text(&out), "--set", "label_rule=main", "--set", "layer_every=2"], 2);
    assert!(train.contains("error: --set label_rule: is main, which needs --set layer_every=1"), "{train}");
    let train = said(&["train", text(&scene), "-o", text(&out), "--random-background", "--exposure", "on"], 2);
    assert!(train.contains("error: --random-background: is on, which needs --exposure off"), "{train}");
    let row = ["ablate", text(&scene), "--masks", text(&scene), "-o", text(&out), "--row", "x=--iterations 0"];
    let ablate = said(&row, 2);
    assert!(ablate.contains("error: --row: x: --iterations: is 0; expected at least 1"), "{ablate}");
}

#[test]
fn flags_and_commands_are_found_as_hands_type_them() {
    for flag in ["--iterations", "--steps", "--iters"] {
        let line = ["labelgs", "train", "scene", "-o", "out", flag, "5"];
        let Verb::Train(args) = Cli::try_parse_from(line).expect(flag).command else { panic!("{flag}") };
        assert_eq!(args.how.settings(None).expect("settings").train.iterations, 5, "{flag}");
    }
    for (verb, flag, colour) in
        [("recolour", "--colour", "1,0,0"), ("recolor", "--color", "red"), ("recolor", "--color", "#f00")]
    {
        let line = ["labelgs", verb, "out", "--labels", "3", flag, colour, "-o", "red.ply"];
        let Verb::Recolour(args) = Cli::try_parse_from(line).expect(verb).command else { panic!("{verb}") };
        assert_eq!(args.colour, [1.0, 0.0, 0.0], "{colour}");
    }
    // A score of its own.
    let line = ["labelgs", "eval", "out", "--scene", "scene", "--lpips", "vgg.safetensors"];
    assert!(
        matches!(Cli::try_parse_from(line).expect("flags").command, Verb::Eval(args) if args.scoring.lpips.is_some())
    );
}

/// What `view` was told of the scene goes to the command that repeats its edits.
#[test]
fn flags_of_a_scene_are_typed_again() {
    let typed = "--test-every 4 --max-resolution 300 --ignore 'no faces' --images photos --max-bad-photos 0.5 --allow-outside \
                 --poses w2c,opengl";
    let words: Vec<&str> = typed.split(' ').collect();
    let words = words.join("\n").replace("'no\nfaces'", "no faces");
    let parsed =
        |verb: &[&str]| Cli::try_parse_from(verb.iter().copied().chain(words.split('\n'))).expect("flags").command;
    let Verb::View(view) = parsed(&["labelgs", "view", "out", "--scene", "scene"]) else { panic!("view") };
    assert_eq!(view.reading.to_flags(), format!(" {typed}"));
    assert!(matches!(parsed(&["labelgs", "edit", "out", "--replay", "e.json", "-o", "a.ply"]), Verb::Edit(_)));
}

#[test]
fn a_number_that_is_none_is_called_so() {
    for (flag, value, problem) in [
        ("--iterations", "lots", "`lots` is not a whole number"),
        ("--steps", "1e4", "`1e4` is not a whole number"),
        ("--iterations", "99999999999999999999", "`99999999999999999999` is too large a number"),
    ] {
        let message = said(&["train", "scene", "-o", "out", flag, value], 2);
        assert!(message.starts_with("error: --") && message.contains(problem), "{message}");
        assert!(message.contains("try '--help'") && !message.contains("digit"), "{message}");
    }
}

#[test]
fn a_misspelt_object_is_answered_with_the_nearest_names() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("model.ply");
    model(&path, 200);
    let name = |id: u32| match id {
        3 => "barrel".to_owned(),
        9 => "red table".to_owned(),
        _ => format!("thing number {id}"),
    };
    let table =
        LabelTable::new((1..=200).map(|id| LabelEntry { name: Some(name(id)), ..LabelEntry::new(id) }).collect());
    table.write(&LabelTable::path_beside(&path)).expect("written");
    let out = folder.path().join("out.ply");
    for (typed, expected) in [
        ("barell", "no label is named barell; did you mean barrel? (run `labelgs list "),
        ("Red Tabel", "no label is named Red Tabel; did you mean red table? (run `labelgs list "),
        ("xyzzy", "no label is named xyzzy; the model has 1 thing number 1, "),
        ("777", "no Gaussian has label 777; the model has 1 thing number 1, "),
    ] {
        for verb in ["extract", "remove", "merge", "split-components"] {
            let message = said(&[verb, text(&path), "--labels", typed, "-o", text(&out)], 2);
            assert!(message.contains(expected) && message.contains("labelgs list "), "{message}");
            let told = message.replace(text(folder.path()), "");
            assert!(told.len() < 300, "{} characters: {told}", told.len());
        }
    }
    let message = said(&["relabel", text(&path), "--map", "777=1", "-o", text(&out)], 2);
    assert!(message.contains("and 194 more (run `labelgs list "), "{message}");
}

#[test]
fn one_thing_is_singular() {
    let folder = tempfile::tempdir().expect("folder");
    let (path, out) = (folder.path().join("model.ply"), folder.path().join("out.ply"));
    model(&path, 1);
    let output = Command::cargo_bin("labelgs").expect("built").args(["convert", text(&path), text(&out)]).output();
    assert!(String::from_utf8_lossy(&output.expect("it runs").stdout).ends_with("1 of 1 Gaussian\n"));
}
