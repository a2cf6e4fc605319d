//! `eval --removal` and `remove --fill` on a made scene, and their bad inputs.

use crate::cli::edits::{labelgs, refused_with as refused, succeeds};
use labelgs::formats::{read_model, write_model};
use serde_json::Value;
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A made scene and a short training of it.
fn trained(folder: &Path) -> (String, String, String) {
    let path = |name: &str| text(&folder.join(name)).to_owned();
    let (scene, masks, run) = (path("scene"), path("scene/masks"), path("run"));
    let small = ["--preset", "simple", "--size", "96x72", "--views", "12", "--points", "600"];
    succeeds(&[&["synth", &scene][..], &small].concat());
    succeeds(&["train", &scene, "--masks", &masks, "--iterations", "200", "-o", &run]);
    (scene, masks, run)
}

#[test]
fn removals_are_scored_and_filled() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let (scene, masks, run) = trained(folder.path());
    let eval = ["eval", &run, "--scene", &scene, "--masks", &masks, "--removal"];
    let scores = succeeds(&eval)["removal"].clone();
    let number = |at: &str| scores.pointer(at).and_then(Value::as_f64).unwrap_or_else(|| panic!("{at}: {scores}"));
    for id in 1..=3 {
        let at = |field: &str| number(&format!("/objects/{id}/{field}"));
        for way in ["votes", "filled", "main", "mean_colour"] {
            let found = (at(&format!("{way}/psnr")), at(&format!("{way}/psnr_shadowed")));
            assert!(found.0 > 4.0 && found.1 > 4.0 && found.0 < 60.0, "object {id}, {way}: {found:?}");
        }
        // Votes give the paper's rule nothing to leave out: its weight is more by far after so short a training.
        assert!(at("votes/leftover_weight") < at("main/leftover_weight"), "object {id}: {scores}");
        assert!((0.0..=1.0).contains(&at("votes/leftover")) && at("hole") <= 1.0);
    }
    let objects = (1..=3).map(|id| number(&format!("/objects/{id}/filled/psnr"))).sum::<f64>() / 3.0;
    assert!((number("/mean/filled/psnr") - objects).abs() < 1e-9);
    // Against the world without the object. Its shadow is not in that truth, and the fill does not draw one.
    assert!(number("/mean/filled/psnr") > number("/mean/votes/psnr") + 1.0, "filling gains: {scores}");
    assert!(number("/mean/hole_filled") < 0.6 * number("/mean/hole"), "holes close: {scores}");

    let (plain, closed) = (folder.path().join("plain.ply"), folder.path().join("closed.ply"));
    succeeds(&["remove", &run, "--labels", "1", "-o", text(&plain)]);
    let args = ["remove", &run, "--labels", "1", "--fill", "--keep-shadow", "--scene", &scene, "-o", text(&closed)];
    let result = succeeds(&args);
    assert_eq!(result["lit"], 0);
    let (plain, filled) = (read_model(&plain).expect("PLY").gaussians, read_model(&closed).expect("PLY").gaussians);
    let added: u64 = result["added"].as_object().expect("labels").values().filter_map(Value::as_u64).sum();
    assert!(added > 0, "the block leaves a hole: {result}");
    let hidden = result["hidden"].as_u64().expect("a number");
    assert_eq!(filled.len() as u64 + hidden, plain.len() as u64 + added);
    // What is left stays as it is, but for what the block hid.
    let kept = filled.filtered(|row| (row as u64) < plain.len() as u64 - hidden);
    let mut rows = kept.means.iter().zip(&kept.sh0).peekable();
    let is_kept =
        |row: usize| rows.next_if(|&(mean, colour)| (*mean, *colour) == (plain.means[row], plain.sh0[row])).is_some();
    assert_eq!(plain.filtered(is_kept), kept);
    let first = std::fs::read(&closed).expect("PLY");
    let told = String::from_utf8(labelgs(&args).stdout).expect("text");
    let of = result["of"].as_u64().expect("a number");
    let removed = of + added - filled.len() as u64;
    let expected = format!("{} Gaussians ({removed} of {of} removed, {added} added)\n", filled.len());
    assert!(told.ends_with(&expected), "{told}");
    assert!(std::fs::read(&closed).expect("PLY") == first, "two runs differ");
    let lit = succeeds(&args.iter().filter(|&&word| word != "--keep-shadow").copied().collect::<Vec<_>>());
    assert!(lit["lit"].is_u64() && lit["hidden"] == result["hidden"], "{lit}");

    // A scene without truth has the weight that is left and no more; a truth of another size is refused.
    std::fs::remove_dir_all(Path::new(&scene).join("shadowed")).expect("removed");
    std::fs::rename(Path::new(&scene).join("without/2"), folder.path().join("kept")).expect("moved");
    let scores = succeeds(&eval)["removal"]["objects"]["2"].clone();
    assert_eq!((&scores["votes"]["psnr"], &scores["votes"]["leftover"]), (&Value::Null, &Value::Null));
    assert!(scores["votes"]["leftover_weight"].is_number(), "{scores}");
    let message = refused(&[&eval[..], &["--max-resolution", "48"]].concat(), 3);
    assert!(message.contains("without/1/000.png") && message.contains("without --max-resolution"), "{message}");
}

#[test]
fn what_is_missing_is_named() {
    let Some(_gpu) = crate::support::device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let (scene, masks, run) = trained(folder.path());
    let out = folder.path().join("out.ply");
    let fill = ["remove", &run, "--labels", "1", "--fill", "-o", text(&out)];
    assert!(refused(&fill, 2).contains("--scene <SCENE>"));
    let keep = ["remove", &run, "--labels", "1", "--keep-shadow", "-o", text(&out)];
    assert!(refused(&keep, 2).contains("--fill"));
    let all = ["remove", &run, "--labels", "0-3", "--fill", "--scene", &scene, "-o", text(&out)];
    assert!(refused(&all, 2).contains("no Gaussian would be left"));
    assert!(!out.exists());

    let eval = ["eval", &run, "--scene", &scene, "--removal"];
    assert!(refused(&eval, 2).contains("--masks <DIR>"));
    let bare = folder.path().join("bare.ply");
    let mut model =
        read_model(Path::new(&run).join("point_cloud/iteration_200/point_cloud.ply")).expect("PLY").gaussians;
    (model.labels, model.label_confidence) = (None, None);
    write_model(&bare, &model).expect("written");
    let message = refused(&["eval", text(&bare), "--scene", &scene, "--masks", &masks, "--removal"], 3);
    assert!(message.contains("has no labels, and --removal needs them"), "{message}");
}
