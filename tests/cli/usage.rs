//! The command line: flags, output streams and exit statuses.

use assert_cmd::Command;
use clap::Parser;
use labelgs::cli::command::{Cli, Command as Verb, command};
use labelgs::cli::support::setting_names::flag;
use labelgs::formats::{read_model, write_model};
use labelgs::run::{Occlusion, Settings, TrainConfig};
use labelgs::scene::Gaussians;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use tempfile::TempDir;

fn labelgs(args: &[&str]) -> Output {
    Command::cargo_bin("labelgs").expect("the tool is built").args(args).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// A model of six Gaussians: labels 0, 1, 1, 3, 3, 3.
fn model(folder: &Path) -> PathBuf {
    let path = folder.join("model.ply");
    let gaussians = Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: (0..6).map(|i| [i as f32, 0.0, 1.0]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; 6],
        scales: vec![[-3.0; 3]; 6],
        opacities: vec![0.0; 6],
        sh0: vec![[0.5; 3]; 6],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some(vec![0, 1, 1, 3, 3, 3]),
        label_confidence: None,
    };
    write_model(&path, &gaussians).expect("written");
    path
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("folder")
}

fn train(flags: &[&str]) -> labelgs::Result<Settings> {
    let line = ["labelgs", "train", "scene", "-o", "out"].iter().chain(flags).copied();
    match Cli::try_parse_from(line).expect("flags").command {
        Verb::Train(args) => args.how.settings(None),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_flag_is_explained_once() {
    let mut root = command();
    root.build();
    for verb in root.get_subcommands().filter(|verb| verb.get_name() != "help") {
        let mut shorts = BTreeSet::new();
        assert!(verb.get_about().is_some(), "{}", verb.get_name());
        for arg in verb.get_arguments() {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            let place = format!("{} {}: {help}", verb.get_name(), arg.get_id());
            assert!(help.len() > 8, "{place}");
            assert!(arg.get_short().is_none_or(|short| shorts.insert(short)), "{place}: short flag twice");
        }
    }
}

#[test]
fn every_setting_has_help_with_its_default_and_those_that_more_people_need_have_a_flag() {
    let root = command();
    let verb = root.find_subcommand("train").expect("train");
    let list = text(&labelgs(&["train", "--settings"]).stdout);
    for key in Settings::keys() {
        let arg = verb.get_arguments().find(|arg| arg.get_id() == key.name);
        assert_eq!(arg.is_some(), key.is_flag, "{}", key.name);
        if let Some(arg) = arg {
            assert_eq!(arg.get_long().map(|long| format!("--{long}")), Some(flag(key.name)));
            for help in [arg.get_help(), arg.get_long_help()].into_iter().flatten().map(ToString::to_string) {
                assert!(help.contains("[default: "), "{}: {help}", key.name);
            }
        }
        let name = if key.is_flag { flag(key.name) } else { format!("--set {}=", key.name) };
        let line = list.lines().find(|line| line.trim_start().starts_with(&name));
        assert!(line.is_some_and(|line| line.contains("[default: ")), "{name} is not in\n{list}");
    }
    let flags = verb.get_arguments().filter(|arg| !arg.is_positional()).count();
    assert!(flags + root.get_arguments().filter(|arg| arg.is_global_set()).count() <= 45, "{flags} flags");
    // Links of rustdoc must not appear in the help.
    for verb in root.get_subcommands() {
        let help = verb.clone().render_long_help().to_string();
        assert!(!help.contains("[`") && !help.contains("`]"), "{help}");
    }
    // Lines of the help are wrapped, so compare without line breaks.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let help = words(&text(&labelgs(&["train", "--help"]).stdout));
    assert!(help.contains("[default: 7000]") && help.contains("[default: off]"), "{help}");
    assert!(
        help.contains(
            "where ours differ: --iterations 15000 --set start_size=1.0 --set full_size_from=0 --set depth_weight=0.0"
        ) && help.contains("--set label_rule=main")
            && help.contains("--exposure off --set strategy=adc --set free_space=off --set far_points=0")
            && help.contains("--set densify_until=40000 --set densify_interval=100 --set opacity_reset_interval=3000"),
        "{help}"
    );
    for heading in ["Options:", "Training:", "Labels:", "Densification:", "Rendering:", "Scene:", "Device:", "Output:"]
    {
        assert!(help.contains(heading), "{heading} is not in\n{help}");
    }
    let one = words(&text(&labelgs(&["train", "--settings", "label_rule"]).stdout));
    assert!(one.starts_with("--set label_rule=<RULE> main, votes cannot change within a run Rule that"), "{one}");
    let unknown = labelgs(&["train", "--settings", "labl_rule"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("no setting labl_rule; did you mean label_rule"), "{unknown:?}");
}

/// A switch that is a flag stands alone, so that it can only turn on.
#[test]
fn a_switch_with_a_flag_is_off_by_default() {
    let defaults = Settings::default().texts();
    let on = Settings::keys().filter(|key| key.is_flag && defaults.get(key.name).is_some_and(|text| text == "on"));
    assert_eq!(on.map(|key| key.name).collect::<Vec<_>>(), Vec::<&str>::new());
    assert!(train(&["--antialias"]).expect("decided").train.antialias);
    assert!(Cli::try_parse_from(["labelgs", "train", "scene", "-o", "out", "--antialias", "on"]).is_err());
    assert!(!train(&["--preset", "best", "--set", "antialias=off"]).expect("decided").train.antialias);
}

#[test]
fn a_setting_is_given_once_and_by_a_known_name() {
    for (typed, expected) in [
        (&["--set", "seed=1", "--seed", "2"][..], "--set seed: --seed sets it too; leave out one"),
        (&["--set", "seed=1", "--set", "seed=2"], "--set seed: is given twice; leave out one"),
        (&["--set", "label_wait=1"], "there is no setting label_wait; did you mean label_weight"),
        (&["--set", "label_weight"], "expected KEY=VALUE, such as label_weight=0.3"),
        (&["--set", "label_rule=most"], "`most` is not one of main, votes"),
        (&["--set", "label_from=soon"], "`soon` is not a whole number"),
        (&["--set", "rate_final=half"], "`half` is not a number"),
        (&["--set", "sh_degree=4"], "--set sh_degree: is 4; expected 0 to 3"),
        (&["--block", "b", "--set", "grow_box=0,0,0,1,1,1"], "grow-box: cannot be given with a block"),
        (&["--occluders", "o.json", "--set", "occlusion=none"], "--set occlusion: cannot be given with --occluders"),
    ] {
        let output = labelgs(&[&["train", "scene", "-o", "out"], typed].concat());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}

/// Commands and their own commands, each with what is typed for it.
fn commands() -> Vec<(String, clap::Command)> {
    let mut root = command();
    root.build();
    let mut found = Vec::new();
    for verb in root.get_subcommands().filter(|verb| verb.get_name() != "help") {
        found.push((format!("labelgs {}", verb.get_name()), verb.clone()));
        let inner = verb.get_subcommands().filter(|inner| inner.get_name() != "help");
        found.extend(inner.map(|inner| (format!("labelgs {} {}", verb.get_name(), inner.get_name()), inner.clone())));
    }
    found
}

#[test]
fn every_help_begins_with_the_result_and_an_example() {
    for (name, verb) in commands() {
        let help = verb.clone().term_width(0).render_long_help().to_string();
        let before = help.split("Usage:").next().unwrap_or_default();
        let examples: Vec<&str> = before.lines().filter_map(|line| line.strip_prefix("Example: ")).collect();
        assert!(help.starts_with(char::is_uppercase) && !help.starts_with("Example"), "{name}: {help}");
        let [example] = examples[..] else { panic!("{name} has not one example:\n{help}") };
        assert!(example.starts_with(&name), "{name}: {example}");
        Cli::try_parse_from(example.split_whitespace()).unwrap_or_else(|error| panic!("{example}: {error}"));
    }
}

#[test]
fn the_first_commands_come_first() {
    let help = text(&labelgs(&["--help"]).stdout);
    let at = |name: &str| help.find(&format!("\n  {name} ")).unwrap_or_else(|| panic!("{name} is not in\n{help}"));
    let first = ["synth", "photos", "train", "eval", "list", "extract", "remove", "render"].map(at);
    assert!(first.is_sorted(), "{help}");
    let others = command().get_subcommands().filter(|verb| at(verb.get_name()) > first[first.len() - 1]).count();
    assert_eq!(others + first.len(), command().get_subcommands().count(), "{help}");
}

/// A flag that several commands have stands under one heading everywhere.
#[test]
fn a_flag_has_one_heading() {
    const SHARED: [&str; 11] = [
        "allow-outside",
        "background",
        "config",
        "device",
        "json",
        "label-table",
        "max-bad-photos",
        "near",
        "quiet",
        "test-every",
        "verbose",
    ];
    for flag in SHARED {
        let headings: BTreeSet<Option<String>> = commands()
            .iter()
            .flat_map(|(_, verb)| verb.get_arguments())
            .filter(|arg| arg.get_long() == Some(flag))
            .map(|arg| arg.get_help_heading().map(str::to_owned))
            .collect();
        assert_eq!(headings.len(), 1, "{flag}: {headings:?}");
        assert!(headings.iter().all(Option::is_some), "{flag}");
    }
}

/// A value other than the default for each setting; none for a flag that needs none.
const TYPED: [(&str, &str); 60] = [
    ("--iterations", "7"),
    ("--max-resolution", "99"),
    ("--set", "start_size=0.7"),
    ("--set", "full_size_from=4"),
    ("--set", "strategy=adc"),
    ("--budget", "9k"),
    ("--set", "prune_share=0.2"),
    ("--set", "contour_share=0.1"),
    ("--set", "free_space=off"),
    ("--set", "far_points=30"),
    ("--exposure", "off"),
    ("--random-background", ""),
    ("--set", "depth_weight=0.1"),
    ("--antialias", ""),
    ("--refine-poses", ""),
    ("--grow-box", "-1,-2,0,1,2,3.5"),
    ("--set", "rate_factor=1.5"),
    ("--set", "rate_final=0.5"),
    ("--test-every", "5"),
    ("--seed", "11"),
    ("--max-gaussians", "2.5M"),
    ("--background", "0.1,0.2,1"),
    ("--set", "near=0.1"),
    ("--set", "label_from=3"),
    ("--set", "moments=half"),
    ("--set", "label_rule=main"),
    ("--set", "vote_every=70"),
    ("--mask-border", "3"),
    ("--set", "label_threshold=0.7"),
    ("--set", "gpf=off"),
    ("--set", "layer_every=1"),
    ("--set", "label_samples=4"),
    ("--set", "label_weight=0.5"),
    ("--set", "label_balance=on"),
    ("--set", "label_alpha=0.2"),
    ("--set", "occlusion=none"),
    ("--set", "occlusion_every=10"),
    ("--set", "sh_degree=1"),
    ("--set", "sh_degree_interval=20"),
    ("--set", "position_lr_init=1e-3"),
    ("--set", "position_lr_final=1e-5"),
    ("--set", "feature_lr=0.1"),
    ("--set", "opacity_lr=0.3"),
    ("--set", "scaling_lr=0.4"),
    ("--set", "rotation_lr=0.5"),
    ("--set", "opacity_weight=0.02"),
    ("--set", "scale_weight=0.03"),
    ("--set", "detail=0.25"),
    ("--set", "densify_from=1"),
    ("--set", "densify_until=2"),
    ("--set", "densify_interval=3"),
    ("--set", "densify_grad_threshold=0.1"),
    ("--set", "opacity_reset_interval=8"),
    ("--set", "opacity_reset_margin=9"),
    ("--set", "save_at=2000,5000"),
    ("--poses", "opengl"),
    ("--set", "preview_every=6"),
    ("--checkpoint-every", "12"),
    ("--photo-memory", "2.5G"),
    ("--masked-only", ""),
];

#[test]
fn every_setting_follows_its_flag() {
    let all: Vec<&str> =
        TYPED.iter().flat_map(|&(flag, value)| [flag, value]).filter(|word| !word.is_empty()).collect();
    let changed = train(&all).expect("decided");
    let (texts, defaults) = (changed.texts(), Settings::default().texts());
    for key in Settings::keys() {
        let is_tried = |&(name, value): &(&str, &str)| match value.split_once('=').filter(|_| name == "--set") {
            Some((name, _)) => !key.is_flag && name == key.name,
            None => key.is_flag && name == flag(key.name),
        };
        assert!(TYPED.iter().any(is_tried), "{} is not tried", key.name);
        assert_ne!(texts.get(key.name), defaults.get(key.name), "{} is out of reach", key.name);
    }
    assert_eq!(changed.train.max_gaussians, 2_500_000);
    assert_eq!(changed.run.save_at, [2000, 5000]);
    assert_eq!(train(&["--set", "grow_box=-1,-2,0,1,2,3.5"]).expect("decided").train.grow_box, changed.train.grow_box);
    assert_eq!(train(&["--set", "max-gaussians=2.5M"]).expect("decided").train.max_gaussians, 2_500_000, "as a flag");
    assert_eq!(train(&["--background", "white"]).expect("decided").train.background, [1.0; 3]);
    assert_eq!(train(&[]).expect("decided"), Settings::default());
}

#[test]
fn presets_decide_length_and_detail_and_flags_override_them() {
    let of = |flags: &[&str]| train(flags).expect("decided").train;
    let short = of(&["--preset", "draft", "--budget", "9k"]);
    assert_eq!((short.iterations, short.budget), (2000, 9000));
    assert_eq!(train(&["--preset", "standard"]).expect("decided"), Settings::default());
    let long = of(&["--preset", "best"]);
    assert!(long.iterations == 30_000 && long.detail > of(&[]).detail);
    assert_eq!(of(&["--preset", "best", "--iterations", "500"]).iterations, 500);
    assert_eq!(of(&["--preset", "paper"]), TrainConfig::paper());
    let line = ["labelgs", "train", "scene", "-o", "out", "--preset", "draft", "--config", "settings.toml"];
    assert!(Cli::try_parse_from(line).is_err());
}

#[test]
fn every_setting_of_a_file_survives_flags_that_nobody_typed() {
    let folder = folder();
    let path = folder.path().join("all.toml");
    let file = path.to_str().expect("UTF-8");
    let all: Vec<&str> =
        TYPED.iter().flat_map(|&(flag, value)| [flag, value]).filter(|word| !word.is_empty()).collect();
    let written = train(&all).expect("decided");
    std::fs::write(&path, written.dump(&[]).expect("TOML")).expect("file");
    assert_eq!(train(&["--config", file]).expect("decided"), written);
    // A flag changes its own setting and no other.
    let defaults = Settings::default().texts();
    for key in Settings::keys().filter(|key| key.name != "save_at") {
        let Some(default) = defaults.get(key.name) else { continue };
        let value = default.replace(['[', ']', ' '], "");
        let set = format!("{}={value}", key.name);
        let texts = train(&["--config", file, "--set", &set]).expect("decided").texts();
        let mut expected = written.texts();
        expected.insert(key.name.to_owned(), default.clone());
        assert_eq!(texts, expected, "{set}");
    }
}

#[test]
fn flags_override_the_file_and_the_file_the_defaults() {
    let folder = folder();
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, "iterations = 300\nocclusion = \"none\"\nbackground = [1, 0.5, 0]\n").expect("file");
    let file = path.to_str().expect("UTF-8");
    let decided = train(&["--config", file, "--iterations", "400"]).expect("decided");
    let config = &decided.train;
    assert_eq!((config.iterations, config.occlusion, config.seed), (400, Occlusion::None, 0));
    assert_eq!(config.background, [1.0, 0.5, 0.0]);

    let dumped = decided.dump(&[("device", "a\nb".into())]).expect("TOML");
    assert!(dumped.contains("# device: a b\n") && dumped.contains("label_threshold = 0.6\n"), "{dumped}");
    std::fs::write(&path, dumped).expect("file");
    assert_eq!(Settings::read(&path).expect("read back"), decided);

    std::fs::write(&path, "iterations = 300\nlambda = 0.2\n").expect("file");
    let message = Settings::read(&path).expect_err("unknown field").to_string();
    assert!(message.contains("line 2") && message.contains("lambda"), "{message}");
    std::fs::write(&path, "label_threshold = 3\n").expect("file");
    let error = train(&["--config", file]).expect_err("out of range");
    assert!(error.to_string().starts_with("label_threshold"), "{error}");
}

#[test]
fn values_that_make_no_sense_are_usage_errors() {
    let broken: [&[&str]; 12] = [
        &[],
        &["paint"],
        &["list"],
        &["train", "scene"],
        &["train", "scene", "-o", "out", "--set", "gpf=maybe"],
        &["train", "scene", "-o", "out", "--grow-box", "1,0,0,0,1,1"],
        &["train", "scene", "-o", "out", "--grow-box", "0,0,0,1,1"],
        &["synth", "x", "--size", "320"],
        &["extract", "model.ply", "-o", "x.ply"],
        &["extract", "model.ply", "-o", "x.ply", "--labels", "3-1"],
        &["render", "model.ply", "-o", "x"],
        &["profile"],
    ];
    for args in broken {
        let output = labelgs(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", text(&output.stderr));
        assert!(output.stdout.is_empty(), "{args:?}");
    }
}

#[test]
fn help_and_version_are_results() {
    for args in [&["--help"] as &[&str], &["-h"], &["--version"], &["train", "-h"], &["help", "eval"]] {
        let output = labelgs(args);
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0), "{args:?}");
        assert!(text(&output.stdout).contains("labelgs"), "{args:?}");
    }
    assert!(text(&labelgs(&["--help"]).stdout).contains("70 a bug"));
}

#[test]
fn labels_of_another_model_need_no_views() {
    let parsed =
        |more: &[&str]| Cli::try_parse_from([&["labelgs", "label", "model.ply", "-o", "x.ply"], more].concat());
    assert!(parsed(&["--like", "labelled.ply", "--label-type", "uint"]).is_ok());
    assert!(parsed(&["--scene", "scene", "--masks", "masks"]).is_ok());
    assert!(parsed(&[]).is_err() && parsed(&["--masks", "masks"]).is_err() && parsed(&["--scene", "scene"]).is_err());
    let others = "--scene s|--masks m|--per-view|--rule main|--mask-border 2|--min-confidence 0.5|--near 0.1|--click a:1,2|\
                  --network n|--test-every 3|--ignore d|--poses c2w|--images d";
    for other in others.split('|') {
        let words: Vec<&str> = other.split(' ').collect();
        let error = parsed(&[&["--like", "labelled.ply"], &words[..]].concat()).expect_err(other);
        assert_eq!(error.kind(), clap::error::ErrorKind::ArgumentConflict, "{other}: {error}");
    }
}

#[test]
fn list_tells_every_label() {
    let folder = folder();
    let model = model(folder.path());
    let model = model.to_str().expect("UTF-8");
    let output = labelgs(&["list", model]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let lines: Vec<String> = text(&output.stdout).lines().map(str::to_owned).collect();
    assert_eq!(lines.len(), 4);
    assert!(lines[1].trim_start().starts_with("none") && lines[3].trim_start().starts_with('3'), "{lines:?}");
    for args in [["list", model, "--json"], ["--json", "list", model]] {
        let json: Value = serde_json::from_slice(&labelgs(&args).stdout).expect("JSON alone on standard output");
        assert_eq!((&json["schema_version"], &json["gaussians"]), (&1.into(), &6.into()));
        assert_eq!((&json["labels"][2]["label"], &json["labels"][2]["count"]), (&3.into(), &3.into()));
        assert_eq!(json["labels"][2]["centre"], serde_json::json!([4.0, 0.0, 1.0]));
        assert!(json["labels"][2]["oriented"]["sizes"][0].as_f64() > Some(0.0), "{json}");
    }
    let output = labelgs(&["list", model, "--csv"]);
    let table = text(&output.stdout);
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert!(rows.len() == 4 && rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
    let cell = |title: &str| rows[3][rows[0].iter().position(|found| *found == title).expect("a column")];
    assert_eq!([cell("label"), cell("gaussians"), cell("centre_x"), cell("centre_z")], ["3", "3", "4", "1"]);
    let size = |number: u32| cell(&format!("box_size_{number}")).parse::<f64>().expect("a number");
    let volume: f64 = cell("volume").parse().expect("a number");
    assert!((size(1) * size(2) * size(3) - volume).abs() < 1e-9 * volume && size(1) >= size(2), "{table}");
    let both = labelgs(&["list", model, "--csv", "--json"]);
    assert!(both.status.code() == Some(2) && text(&both.stderr).contains("--csv"), "{}", text(&both.stderr));
}

#[test]
fn extract_and_remove_write_the_two_parts() {
    let folder = folder();
    let model = model(folder.path());
    let part = folder.path().join("part.ply");
    let (model, out) = (model.to_str().expect("UTF-8"), part.to_str().expect("UTF-8"));
    for (verb, expected) in [("extract", vec![0, 3, 3, 3]), ("remove", vec![1, 1])] {
        let output = labelgs(&[verb, model, "--labels", "3,0", "-o", out, "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((&json["gaussians"], &json["of"]), (&expected.len().into(), &6.into()));
        assert_eq!(read_model(&part).expect("PLY").gaussians.labels, Some(expected));
    }
    let before = std::fs::read(&part).expect("file");
    let output = labelgs(&["extract", model, "--labels", "2,3", "-o", out]);
    assert_eq!(output.status.code(), Some(2));
    let message = text(&output.stderr);
    assert!(
        message.starts_with("error: --labels: no Gaussian has label 2; the model has 1, 3, and 0 for the unlabelled"),
        "{message}"
    );
    assert_eq!(std::fs::read(&part).expect("file"), before, "a failed run leaves the old file");
}

#[test]
fn bad_input_and_bad_output_have_their_own_status() {
    let folder = folder();
    let model = model(folder.path());
    let model = model.to_str().expect("UTF-8");
    let output = labelgs(&["list", "no-such.ply"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(text(&output.stderr).contains("no-such.ply"));
    // A file where a folder is needed.
    let output = labelgs(&["extract", model, "--labels", "1", "-o", &format!("{model}/part.ply")]);
    assert_eq!(output.status.code(), Some(7), "{}", text(&output.stderr));
}

#[test]
fn synth_makes_a_scene_once() {
    let folder = folder();
    let scene = folder.path().join("scene");
    let scene = scene.to_str().expect("UTF-8");
    let args = ["synth", scene, "--size", "32x24", "--views", "4", "--points", "20", "--preset", "simple", "--json"];
    let output = labelgs(&args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&json["views"], &json["objects"][1]["name"]), (&4.into(), &"ball".into()));
    for file in [
        "images/003.png",
        "masks/000.png",
        "amodal/3/001.png",
        "depth/002.exr",
        "sparse/0/points3D.bin",
        "objects/2/002.png",
        "without/2/000.png",
        "shadowed/3/000.png",
        "masks/labels.json",
    ] {
        assert!(Path::new(scene).join(file).is_file(), "{file}");
    }
    assert_eq!(labelgs(&args).status.code(), Some(2), "the folder is not empty any more");
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = folder();
    let model = model(folder.path());
    let (reader, writer) = std::io::pipe().expect("pipe");
    drop(reader);
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"))
        .arg("list")
        .arg(&model)
        .stdout(writer)
        .output()
        .expect("it runs");
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
}

#[cfg(unix)]
#[test]
fn a_signal_has_its_own_status() {
    for (signal, status) in [("-INT", 130), ("-TERM", 143)] {
        let folder = folder();
        let scene = folder.path().join("scene");
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"))
            .args(["synth", "--views", "5000", "--size", "16x12", "--points", "1"])
            .arg(&scene)
            .stderr(Stdio::null())
            .spawn()
            .expect("it runs");
        // The signal handlers are installed before the first picture.
        while !scene.join("images/000.png").exists() {
            assert_eq!(child.try_wait().expect("child"), None);
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
        assert_eq!(child.wait().expect("child").code(), Some(status));
    }
}
