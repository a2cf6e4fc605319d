//! The command line with a device: `devices`, `plan`, `profile`, and a scene from `synth` to pictures.

use assert_cmd::Command;
use labelgs::formats::read_model;
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn labelgs(args: &[&str]) -> Output {
    let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
    // The validation layer watches this process only.
    command.env("LABELGS_VALIDATION", "off").args(args).output().expect("it runs")
}

/// Returns a turn with the device: processes that run at once would only wait for each other.
fn turn() -> Option<crate::support::device::Turn> {
    crate::support::device()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[track_caller]
fn succeeds(args: &[&str]) -> String {
    let output = labelgs(args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[track_caller]
fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn devices_tells_what_is_needed_and_found() {
    let Some(gpu) = turn() else { return };
    let name = gpu.capabilities().name.clone();
    let table = succeeds(&["devices"]);
    assert!(
        table.contains(&name) && table.contains("timelineSemaphore") && table.contains("kernels subgroups of"),
        "{table}"
    );
    let found = json(&succeeds(&["devices", "--json"]));
    let devices = found["devices"].as_array().expect("a list");
    let device = devices.iter().find(|device| device["name"] == name).expect("the device of the tests");
    assert!(device["kernels"]["tile"][0].as_u64() >= Some(8) && device["usable"] == true, "{device}");
    assert_eq!(devices.iter().filter(|device| device["picked"] == true).count(), 1);
    let output = labelgs(&["devices", "--device", "no such device"]);
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
    assert!(!output.stdout.is_empty(), "the table is printed all the same");
}

#[test]
fn the_sizes_of_a_plan_add_up_to_its_total() {
    let args = ["plan", "--gaussians", "2k", "--size", "160x120", "--label-samples", "4", "--sh-degree", "2"];
    let table = succeeds(&args);
    for part in ["MEMORY", "SCRATCH ARENA", "PASSES", "barrier: cull", "blend_backward_labels", "v_instances", "total"]
    {
        assert!(table.contains(part), "{part} is not in\n{table}");
    }
    let end: Vec<&str> = table.lines().rev().take(3).collect();
    assert!(end[2].starts_with("needed: ") && end[2].contains(" MiB at the start, of "), "{end:?}");
    assert!(end[1].starts_with("fits:    up to ") && end[1].contains(" Gaussians"), "{end:?}");
    assert!(end[0].starts_with("savings: half of "), "{end:?}");
    let plan = json(&succeeds(&[&args[..], &["--json"]].concat()));
    let sum = |key: &str| {
        let rows = plan["memory"]["buffers"].as_array().expect("buffers").iter();
        rows.filter(|row| row["class"] != "step").map(|row| row[key].as_u64().expect("bytes")).sum::<u64>()
    };
    let pages =
        plan["memory"]["scratch_pages"].as_array().expect("pages").iter().filter_map(Value::as_u64).sum::<u64>();
    let staging = plan["memory"]["staging"].as_u64().expect("staging");
    let votes = plan["memory"]["total_while_counting_votes"].as_u64().expect("bytes");
    assert_eq!(plan["memory"]["total"], (sum("bytes") + pages + staging).max(votes));
    assert!(table.contains("vote counting, between steps: votes 4 MiB"), "8 bytes for each of 256 labels\n{table}");
    let names: Vec<&str> =
        plan["passes"].as_array().expect("passes").iter().filter_map(|pass| pass["name"].as_str()).collect();
    assert!(names[0] == "step_begin" && names.iter().any(|name| name.starts_with("layer_list")), "{names:?}");
    let without =
        json(&succeeds(&["plan", "--gaussians", "2k", "--size", "160x120", "--label-samples", "0", "--json"]));
    assert!(without["memory"]["total"].as_u64() < plan["memory"]["total"].as_u64());
    assert!(!without.to_string().contains("layer_list"));
}

#[test]
fn a_plan_for_a_card_needs_no_card() {
    let args = |memory| ["plan", "--gaussians", "10M", "--size", "1600x1064", "--card", memory, "--json"];
    let plan = json(&succeeds(&args("80G")));
    assert_eq!(plan["kernels"]["subgroup_size"], 32, "{}", plan["kernels"]);
    let total = plan["memory"]["total"].as_u64().expect("bytes");
    assert!((8 << 30..80 << 30).contains(&total), "{total} bytes");
    assert_eq!(labelgs(&args("8G")).status.code(), Some(5));
    // The number that a plan says to fit does fit.
    let plan = succeeds(&["plan", "--gaussians", "1M", "--card", "8G"]);
    let most = plan.lines().find_map(|line| line.strip_prefix("fits:    up to ")).expect("a line");
    let most = most.split(' ').next().expect("a number");
    succeeds(&["plan", "--gaussians", most, "--card", "8G"]);
    let more = format!("{}", most.parse::<u64>().expect("a number") * 101 / 100);
    assert_eq!(labelgs(&["plan", "--gaussians", &more, "--card", "8G"]).status.code(), Some(5));
    // Where full moments do not fit and packed ones do, it says so.
    let many = ["plan", "--gaussians", "10M", "--card", "8G", "--label-samples", "0"];
    let output = labelgs(&many);
    assert!(
        output.status.code() == Some(5)
            && text(&output.stdout).contains("fits with `labelgs train --set moments=half`")
    );
    let half = succeeds(&[&many[..], &["--moments", "half"]].concat());
    assert!(half.contains("16-bit moments") && !half.contains("u_means"), "{half}");
    // Where both fit, it proposes packed ones for many Gaussians only.
    let advises = |gaussians, moments| {
        let plan = succeeds(&["plan", "--gaussians", gaussians, "--card", "80G", "--moments", moments]);
        plan.contains("moments: --moments half saves")
    };
    assert!(advises("2M", "full") && !advises("2M", "half") && !advises("1999k", "full"));
}

/// A scene of `labelgs synth`, 96 x 72 px.
fn scene(folder: &Path) -> String {
    let scene = folder.join("scene").to_str().expect("UTF-8").to_owned();
    succeeds(&["synth", &scene, "--preset", "simple", "--size", "96x72", "--views", "12", "--points", "400"]);
    scene
}

/// Width and height of the photos of a made scene.
fn image_size(scene: &str) -> Value {
    let first = Path::new(scene).join("images/000.png");
    let (width, height) = labelgs::files::image::photo_size(&first).expect("a photo");
    serde_json::json!([width, height])
}

#[test]
fn profile_times_every_stage() {
    let Some(_gpu) = turn() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let scene = scene(folder.path());
    let file = folder.path().join("profile.json");
    let masks = format!("{scene}/masks");
    let args = [
        "profile",
        &scene,
        "--masks",
        &masks,
        "--steps",
        "6",
        "--warm-up",
        "3",
        "--from-step",
        "4",
        "--json",
        file.to_str().expect("UTF-8"),
    ];
    let table = succeeds(&args);
    assert!(table.contains("per (pixel, splat) pair walked, ns: blend forward"), "{table}");
    let found = json(&std::fs::read_to_string(&file).expect("written"));
    let stages: Vec<&str> =
        found["stages"].as_array().expect("stages").iter().filter_map(|row| row["stage"].as_str()).collect();
    assert_eq!(
        stages,
        [
            "project",
            "sort",
            "tile",
            "blend forward",
            "loss",
            "blend backward",
            "gather",
            "project backward",
            "optimise",
            "report"
        ]
    );
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    let shares: f64 = found["passes"].as_array().expect("passes").iter().filter_map(|row| row["share"].as_f64()).sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
    assert!(number("/passes_ms/median") > 0.0 && number("/ns_per_pair/blend_backward") > 0.0);
    assert!(number("/pipeline_ms/mean") >= 0.3 * number("/passes_ms/median"), "the clock ends after the last step");
    assert_eq!(found["steps"].as_array().map(Vec::len), Some(6));
    assert_eq!(found.pointer("/steps/0/step"), Some(&8.into()));
    // Steps as at the end of a run, and told as what they are.
    let photo = image_size(&scene);
    assert_eq!((&found["size"], &found["sh_degree"], &found["labels"]), (&photo, &3.into(), &true.into()));
    // A processor has the photo written for each step.
    let pixels = photo[0].as_f64().expect("px") * photo[1].as_f64().expect("px");
    assert!((4.0 * pixels..12.0 * pixels + 8192.0).contains(&number("/bytes_to_device")), "{found}");
    assert!((8.0..512.0).contains(&number("/bytes_from_device")), "{found}");
    assert!(found["steps"].as_array().expect("steps").iter().all(|step| step["size"] == photo));
    assert!(
        found["steps_with_layers"].as_u64() > Some(0) && table.contains(" px, degree 3, object layers in "),
        "{table}"
    );
    let early = json(&succeeds(&["profile", &scene, "--steps", "2", "--warm-up", "1", "--as-scheduled", "--json"]));
    assert!(early["sh_degree"] == 0 && early["labels"] == false && early["size"] != photo, "{early}");
    let file = file.to_str().expect("UTF-8");
    let same = succeeds(&["profile", "--compare", file, file]);
    assert!(same.contains("blend backward") && same.contains("pairs_walked") && !same.contains("slower"), "{same}");
    let slow = folder.path().join("slow.json");
    let mut slower = found.clone();
    for step in slower["steps"].as_array_mut().expect("steps") {
        step["stages_ms"]["gather"] = 1e6.into();
    }
    std::fs::write(&slow, slower.to_string()).expect("written");
    let slow = slow.to_str().expect("UTF-8");
    let refused = labelgs(&["profile", "--compare", file, slow]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("slower beyond noise: all, gather"), "{}", text(&refused.stderr));
    succeeds(&["profile", "--compare", slow, file]);
    assert_eq!(labelgs(&["profile", "--compare", file, &masks]).status.code(), Some(3));
    let overlap = json(&succeeds(&["profile", &scene, "--steps", "3", "--warm-up", "2", "--overlap", "--json"]));
    assert!(overlap["labels"] == false && overlap["barrier_before_each_pass"] == false);
}

/// The regions cover a view; a near plane beyond the scene leaves nothing.
fn scores_by_region_and_near_plane(out: &str, scene: &str, masks: &str) {
    let base = ["eval", out, "--scene", scene, "--masks", masks];
    let scores = json(&succeeds(&[&base[..], &["--json"]].concat()));
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("no number in {scores}"));
    for view in scores["views"].as_object().expect("views").values() {
        let error = |key: &str| 10.0_f64.powf(-0.1 * number(&view[key]));
        let share = number(&view["seen_share"]);
        assert!(share > 0.2 && share <= 1.0, "{share}");
        if share < 1.0 {
            let all = share * error("psnr_seen") + (1.0 - share) * error("psnr_unseen");
            assert!((all / error("psnr") - 1.0).abs() < 1e-6, "the regions make up the view: {view}");
        }
        assert!(
            number(&view["psnr_seen_corrected"]) + 1e-3 > number(&view["psnr_seen"]),
            "the identity is a map: {view}"
        );
        assert!(number(&view["psnr_objects"]) > 5.0 && number(&view["psnr_contours"]) > 5.0);
    }
    let far = json(&succeeds(&[&base[..], &["--json", "--near", "50"]].concat()));
    let psnr = |scores: &Value| scores["mean"]["psnr"].as_f64().expect("a number");
    assert!(psnr(&far) + 1.0 < psnr(&scores), "nothing is left beyond 50: {far}");
    let text = succeeds(&base);
    assert!(text.contains("PSNR by region: ") && text.contains("contours"), "{text}");
}

#[test]
fn a_made_scene_is_trained_scored_edited_and_rendered() {
    let Some(_gpu) = turn() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let scene = scene(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (out, masks, object, rest) = (path("out"), format!("{scene}/masks"), path("object.ply"), path("rest.ply"));
    let train =
        ["train", &scene, "-o", &out, "--masks", &masks, "--iterations", "150", "--set", "label_from=60", "--json"];
    let trained = json(&succeeds(&train));
    assert_eq!((&trained["steps"], trained["model"].is_string()), (&150.into(), true));
    assert!(trained["test"]["psnr"].as_f64() > Some(12.0), "{trained}");

    let listed = json(&succeeds(&["list", &out, "--json"]));
    let labels: Vec<u64> =
        listed["labels"].as_array().expect("rows").iter().filter_map(|row| row["label"].as_u64()).collect();
    assert!(labels.contains(&2) && listed["gaussians"] == trained["gaussians"], "{listed}");
    let named = listed["labels"].as_array().expect("rows").iter().find(|row| row["label"] == 2);
    assert_eq!(named.expect("label 2")["name"], "ball", "the run has the names of its masks");

    let scores = json(&succeeds(&["eval", &out, "--scene", &scene, "--masks", &masks, "--json"]));
    assert!(scores["mean"]["psnr"].as_f64() > Some(12.0), "{scores}");
    for key in ["iou_map", "boundary_iou", "object_ssim"] {
        assert!(scores["objects"]["2"][key].is_number(), "{key}: {scores}");
    }
    scores_by_region_and_near_plane(&out, &scene, &masks);
    let failed = labelgs(&["eval", &out, "--scene", &scene, "--min-psnr", "90"]);
    assert_eq!(failed.status.code(), Some(1), "{}", text(&failed.stderr));
    assert!(text(&failed.stdout).contains("PSNR"), "a failed check comes after the scores");

    let (truth, page) = (path("truth"), path("page"));
    for (view, object) in [("000", 1), ("000", 2), ("008", 1), ("008", 2)] {
        let mask = labelgs::masks::read_mask(format!("{masks}/{view}.png")).expect("a mask");
        let bytes: Vec<u8> = mask.ids.iter().map(|&id| if id == object { 255 } else { 0 }).collect();
        let file = format!("{truth}/{view}/{object}.png");
        labelgs::files::image::write_png_grey8(file, mask.width, mask.height, &bytes).expect("written");
    }
    let by_name = ["benchmark", &out, "--scene", &scene, "--protocol", "lerf-mask", "--truth", &truth, "--page", &page];
    let found = json(&succeeds(&[&by_name[..], &["--json"]].concat()));
    assert_eq!((&found["mean"]["pair_count"], &found["missing"]), (&4.into(), &serde_json::json!([])), "{found}");
    assert!(found["objects"]["2"]["labels"][0] == 2 && found["objects"]["2"]["iou"].is_number(), "{found}");
    assert!(Path::new(&page).join("00004-difference.png").is_file() && Path::new(&page).join("index.html").is_file());
    let by_mask = ["benchmark", &out, "--scene", &scene, "--protocol", "labelgs", "--truth", &truth];
    let table = succeeds(&by_mask);
    assert!(table.contains("no weights") && table.contains("mean of objects"), "{table}");

    succeeds(&["extract", &out, "--labels", "2", "-o", &object]);
    let sure = read_model(&object).expect("PLY").gaussians.label_confidence.expect("votes tell how sure they are");
    assert!(sure.iter().all(|&share| share >= 0.6));
    let said = json(&succeeds(&["extract", &out, "--labels", "2", "-o", &object, "--json"]));
    let whole = listed["labels"].as_array().and_then(|rows| rows.iter().find(|row| row["label"] == 2));
    let count = whole.and_then(|row| row["count"].as_u64());
    assert_eq!(count, Some(sure.len() as u64 + said["unsure"].as_u64().expect("a number")), "{said}");
    succeeds(&["extract", &out, "--labels", "2", "--min-confidence", "0", "-o", &object]);
    succeeds(&["remove", &out, "--labels", "2", "-o", &rest]);
    let (object_model, rest_model) =
        (read_model(&object).expect("PLY").gaussians, read_model(&rest).expect("PLY").gaussians);
    assert_eq!(object_model.len() + rest_model.len(), trained["gaussians"].as_u64().expect("a number") as usize);
    assert!(object_model.labels.as_ref().is_some_and(|labels| labels.iter().all(|&label| label == 2)));
    let whole = ["extract", &out, "--labels", "2", "--min-confidence", "0", "-o", &object];
    succeeds(&[&whole[..], &["--refit", "--scene", &scene, "--masks", &masks]].concat());
    let alone = read_model(&object).expect("PLY").gaussians;
    assert!(alone.opacities != object_model.opacities, "opacities of its own");
    assert_eq!(labelgs::scene::Gaussians { opacities: object_model.opacities.clone(), ..alone }, object_model);
    let lacks = labelgs(&[&whole[..], &["--refit", "--scene", &scene]].concat());
    assert!(lacks.status.code() == Some(2) && text(&lacks.stderr).contains("--masks"), "{}", text(&lacks.stderr));
    let unknown = labelgs(&["extract", &out, "--labels", "77", "-o", &object]);
    assert_eq!(unknown.status.code(), Some(2), "{}", text(&unknown.stderr));

    let pictures = path("pictures");
    let what = "rgb,depth,alpha,labels,top-id,top-weight";
    succeeds(&[
        "render", &rest, "--scene", &scene, "--views", "000,005", "--what", what, "--format", "exr", "-o", &pictures,
    ]);
    for file in
        ["000.rgb.exr", "005.depth.exr", "000.alpha.exr", "005.labels.png", "000.top-id.exr", "000.top-weight.exr"]
    {
        assert!(Path::new(&pictures).join(file).is_file(), "{file}");
    }
    assert_eq!(
        labelgs(&["render", &rest, "--scene", &scene, "--views", "nowhere", "-o", &pictures]).status.code(),
        Some(2)
    );
    assert_eq!(
        labelgs(&["render", &scene, "--scene", &scene, "-o", &pictures]).status.code(),
        Some(3),
        "no model in there"
    );
}

#[test]
fn selftest_prints_a_row_for_each_check() {
    let Some(_gpu) = turn() else { return };
    let table = succeeds(&["selftest"]);
    assert!(
        table.contains("blend backward") && table.contains("training twice") && !table.contains("FAILED"),
        "{table}"
    );
    let found = json(&succeeds(&["selftest", "--json"]));
    assert_eq!(found["passed"], true);
    let checks = found["checks"].as_array().expect("a list");
    assert!(checks.len() > 20 && checks.iter().all(|check| check["error"].as_f64() <= Some(1.0)), "{found}");
}

#[test]
fn render_and_eval_take_the_resolution_of_the_run() {
    let Some(_turn) = turn() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (scene, out) = (path("scene"), path("out"));
    succeeds(&["synth", &scene, "--preset", "simple", "--size", "64x48", "--views", "6", "--points", "100"]);
    let masks = path("scene/masks");
    let train = ["train", &scene, "--masks", &masks, "-o", &out, "--iterations", "5", "--max-resolution", "32"];
    succeeds(&[&train[..], &["--test-every", "3"]].concat());
    let size = |flags: &[&str]| {
        let pictures = path(&format!("pictures{}", flags.len()));
        let base = ["render", &out, "--scene", &scene, "-o", &pictures, "--json"];
        let printed = json(&succeeds(&base.iter().chain(flags).copied().collect::<Vec<_>>()));
        let files = printed["files"].as_array().expect("files").clone();
        let first = image::image_dimensions(files[0].as_str().expect("a file")).expect("a picture");
        (files.len(), first)
    };
    assert_eq!(size(&[]), (2, (32, 24)), "what the run was trained at, and its own test views");
    assert_eq!(size(&["--max-resolution", "64", "--test-every", "2"]), (3, (64, 48)), "what is typed wins");
    let printed = json(&succeeds(&["eval", &out, "--scene", &scene, "--masks", &masks, "--json"]));
    assert_eq!(printed["views"].as_object().expect("views").len(), 2);
    let stored = json(&std::fs::read_to_string(path("out/metrics.json")).expect("metrics"));
    assert_eq!(printed["mean"]["psnr"], stored["test"]["psnr"], "scores of the run and of `eval` are of one size");
    let iou = |scores: &Value| scores["iou_map"].as_f64().expect("a score");
    assert!(iou(&printed["mean"]) > 0.0, "{printed}");
    assert_eq!(iou(&printed["mean"]), iou(&stored["test"]), "the run scores the labels that it saves");
}
