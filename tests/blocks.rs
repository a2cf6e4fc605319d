//! Scenes in blocks: frozen Gaussians, the split, trainings of blocks, the merge and what it refuses.

use crate::invariants::training::{config, small};
use crate::support::device;
use crate::support::runs::{Place, copy, stderr, succeeded};
use glam::DVec3;
use labelgs::formats::read_model;
use labelgs::records::block_file::{BlockFile, BlocksFile};
use labelgs::run::{LabelRule, StrategyKind, TrainConfig};
use labelgs::scene::{Gaussians, Zone};
use labelgs::scenes::initial_gaussians;
use labelgs::train::Trainer;
use labelgs::train::setup::TrainerOptions;
use labelgs::train::setup::region::Region;
use labelgs::train::state::TrainState;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Gaussians at the end of the first models that stay as they are.
const FROZEN_COUNT: u32 = 40;

fn region() -> Region {
    let zone =
        Zone { low: DVec3::splat(f64::NEG_INFINITY), high: DVec3::splat(f64::INFINITY), ..Zone::along_world([0.0; 6]) };
    Region { frozen: FROZEN_COUNT, zone, extent: 3.0, exposures: BTreeMap::new() }
}

fn options() -> TrainerOptions {
    TrainerOptions { region: Some(region()), ..TrainerOptions::default() }
}

/// A first model with labels.
fn start() -> Gaussians {
    let mut model = initial_gaussians(&small(), 0, 100).expect("points");
    model.labels = Some((0..model.len()).map(|row| row as u32 % 3).collect());
    model
}

fn go_on(trainer: &mut Trainer, until: u32) -> TrainState {
    while trainer.steps_done() < until {
        trainer.step().expect("a step");
    }
    trainer.state().expect("a state")
}

fn settings(strategy: StrategyKind) -> TrainConfig {
    TrainConfig {
        iterations: 60,
        densify_from: Some(5),
        densify_interval: Some(10),
        densify_grad_threshold: 1e-7,
        budget: 3 * start().len() as u64,
        label_from: Some(20),
        antialias: true,
        opacity_reset_interval: 15,
        opacity_reset_margin: 10,
        strategy,
        ..config(LabelRule::Votes)
    }
}

#[test]
fn frozen_gaussians_are_drawn_and_stay() {
    let Some(turn) = device() else { return };
    let first = start();
    let kept = first.len() - FROZEN_COUNT as usize;
    let tail = |model: &Gaussians| model.filtered(|row| row + FROZEN_COUNT as usize >= model.len());
    let bare = |model: Gaussians| Gaussians {
        label_confidence: None,
        antialiased: false,
        sh_degree: 0,
        sh_rest: Vec::new(),
        ..model
    };
    for strategy in [StrategyKind::Budget, StrategyKind::Mcmc, StrategyKind::Adc] {
        let mut trainer = Trainer::new(turn.gpu(), settings(strategy), &small(), &first, options()).expect("a trainer");
        let half = go_on(&mut trainer, 30);
        let last = go_on(&mut trainer, 60);
        let model = trainer.labelled_model().expect("a model");
        assert!(model.len() > first.len(), "{strategy:?} grows to {}", model.len());
        assert_eq!(bare(tail(&model)), bare(tail(&first)), "{strategy:?}");
        assert!(tail(&model).sh_rest.iter().all(|&triple| triple == [0.0; 3]));
        assert!(model.means[..kept].iter().zip(&first.means).any(|(a, b)| a != b), "the others are trained");
        let plane = |name: &str| last.planes.iter().find(|plane| plane.name == name).expect("a plane");
        assert_eq!(plane("m_means").data.len() / 4, model.len() - FROZEN_COUNT as usize, "frozen ones have no moments");
        assert_eq!((plane("means").data.len() / 4, last.frozen), (model.len(), FROZEN_COUNT));

        let mut resumed = Trainer::resume(turn.gpu(), &small(), half.clone(), options()).expect("it goes on");
        assert_eq!(go_on(&mut resumed, 60).planes, last.planes, "{strategy:?} goes on bit for bit");
        let without = Trainer::resume(turn.gpu(), &small(), half, TrainerOptions::default()).err().expect("refused");
        assert!(without.to_string().contains("0 frozen Gaussians, but 40 are in"), "{without}");
    }
}

#[test]
fn a_region_needs_something_to_train() {
    let Some(turn) = device() else { return };
    let all = Region { frozen: start().len() as u32, ..region() };
    let options = TrainerOptions { region: Some(all), ..TrainerOptions::default() };
    let trainer = Trainer::new(turn.gpu(), settings(StrategyKind::Budget), &small(), &start(), options);
    assert!(trainer.err().expect("refused").to_string().contains("none would be trained"));
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

/// A scene with a coarse model and two blocks, trained but for those that a test trains itself.
fn split() -> Place {
    let place = Place::new();
    succeeded(&place.trained("coarse", &["--iterations", "60"]));
    let (scene, coarse, blocks) = (place.text("scene"), place.text("coarse"), place.text("blocks"));
    let typed = ["blocks", "split", &scene, "--model", &coarse, "--card", "8G", "--blocks", "2", "-o", &blocks];
    succeeded(&place.labelgs(&typed));
    place
}

fn train_block(place: &Place, id: &str, flags: &[&str]) -> std::process::Output {
    let block = place.text(&format!("blocks/{id}"));
    place.trained(&format!("models/{id}"), &[&["--block", &block, "--resume", "--iterations", "60"], flags].concat())
}

fn merge(place: &Place, flags: &[&str]) -> std::process::Output {
    let (blocks, models, out) = (place.text("blocks"), place.text("models"), place.text("city"));
    place.labelgs(&[&["blocks", "join", &blocks, "-m", &models, "-o", &out], flags].concat())
}

fn model_of(place: &Place, folder: &str) -> Gaussians {
    let path = labelgs::run::latest_model(&place.path(folder)).expect("a model");
    read_model(path).expect("a model").gaussians
}

#[test]
fn a_scene_is_split_trained_and_merged() {
    let Some(_turn) = device() else { return };
    let place = split();
    let (file, _) = BlocksFile::read(&place.path("blocks")).expect("a list");
    let coarse = model_of(&place, "coarse");
    let ids: Vec<&str> = file.blocks.iter().map(|row| row.id.as_str()).collect();
    assert_eq!(ids, ["b000", "b001"]);
    // Every place is in one core, and a plan says the same as the split.
    for row in 0..coarse.len() {
        let at = coarse.world(row);
        let cores = file.blocks.iter().filter(|block| block.core.zone(file.axes).contains(at)).count();
        assert_eq!(cores, 1, "{at}");
    }
    let (scene, model) = (place.text("scene"), place.text("coarse"));
    let typed = ["blocks", "split", &scene, "--model", &model, "--card", "8G", "--blocks", "2", "--dry-run", "--json"];
    let plan: Value = serde_json::from_slice(&place.labelgs(&typed).stdout).expect("JSON");
    assert_eq!(plan["blocks"][1]["frozen"].as_u64(), Some(file.blocks[1].frozen));
    for id in ids {
        let block = BlockFile::read(&place.path(&format!("blocks/{id}"))).expect("a block");
        let first = read_model(place.path(&format!("blocks/{id}/init.ply"))).expect("a model").gaussians;
        let (zone, trained) = (block.zone.zone(file.axes), first.len() - block.frozen as usize);
        let grows = |at: DVec3| zone.contains(at) && !file.is_far(at);
        assert!((0..first.len()).all(|row| grows(first.world(row)) == (row < trained)));
        succeeded(&train_block(&place, id, &[]));
        let after = model_of(&place, &format!("models/{id}"));
        let frozen = |model: &Gaussians| model.filtered(|row| row + block.frozen as usize >= model.len()).means;
        assert_eq!(frozen(&after), frozen(&first));
    }
    succeeded(&merge(&place, &[]));
    let result = json(&place.path("city/merge.json"));
    let city = model_of(&place, "city");
    assert_eq!(result["gaussians"].as_u64(), Some(city.len() as u64));
    assert_eq!(result["coarse"].as_u64(), Some(file.rest));
    // The rows are those of the cores, in the order of the blocks and of their models, then the coarse ones.
    let mut expected = Vec::new();
    for row in &file.blocks {
        let (trained, core) = (model_of(&place, &format!("models/{}", row.id)), row.core.zone(file.axes));
        let own = 0..trained.len() - row.frozen as usize;
        expected.extend(own.map(|row| trained.world(row)).filter(|&at| core.contains(at)));
    }
    let rest = read_model(place.path("blocks/rest.ply")).expect("a model").gaussians;
    expected.extend((0..rest.len()).map(|row| rest.world(row)));
    assert_eq!((0..city.len()).map(|row| city.world(row)).collect::<Vec<_>>(), expected);
    // Masks of each block alone: objects that both blocks have get one id.
    let masks = place.path("block-masks");
    for id in ["b000", "b001"] {
        copy(&place.path("scene/masks"), &masks.join(id));
    }
    let masks = masks.to_str().expect("UTF-8").to_owned();
    succeeded(&merge(&place, &["--block-masks", &masks, "--scene", &scene]));
    let joined = model_of(&place, "city");
    let mut pairs: Vec<(u32, u32)> = (0..city.len()).map(|row| (city.label(row), joined.label(row))).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let rest = |(_, id): &(u32, u32)| *id > 0;
    let objects: Vec<u32> = pairs.iter().filter(|pair| rest(pair)).map(|(old, _)| *old).collect();
    assert_eq!(objects, [1, 2, 3], "each object has one id: {pairs:?}");
    succeeded(&merge(&place, &[]));
    // The only held-out view of so small a scene says little.
    let scored = |model: &str| {
        let scores = place.text("scores.json");
        let typed = ["eval", &place.text(model), "--scene", &scene, "--views", "train", "--json", &scores];
        succeeded(&place.labelgs(&typed));
        json(Path::new(&scores))
    };
    let (merged, before) = (scored("city"), scored("coarse"));
    let psnr = |scores: &Value| scores["mean"]["psnr"].as_f64().expect("a score");
    assert!(psnr(&merged) > psnr(&before) + 1.0, "{} after {}", psnr(&merged), psnr(&before));
    assert!(merged["places"]["seams"]["pixels"].as_u64() > Some(0) && before["places"].is_null());
    let before = std::fs::read(labelgs::run::latest_model(&place.path("city")).expect("a model")).expect("bytes");
    succeeded(&merge(&place, &[]));
    assert_eq!(
        std::fs::read(labelgs::run::latest_model(&place.path("city")).expect("a model")).expect("bytes"),
        before
    );
}

#[test]
fn a_merge_lists_all_that_is_wrong() {
    let Some(_turn) = device() else { return };
    let place = split();
    let none = merge(&place, &[]);
    let text = stderr(&none);
    assert_eq!(none.status.code(), Some(3), "{text}");
    assert!(
        text.contains("2 problems")
            && text.contains("b000: no block was trained")
            && text.contains("b001: no block was trained"),
        "{text}"
    );
    assert!(!place.path("city").exists(), "nothing is written");
    // With nothing trained, the merged model is the coarse one.
    succeeded(&merge(&place, &["--allow-missing"]));
    let (city, coarse) = (model_of(&place, "city"), model_of(&place, "coarse"));
    let sorted = |model: &Gaussians| {
        let mut rows: Vec<([u32; 3], u32)> =
            (0..model.len()).map(|row| (model.means[row].map(f32::to_bits), model.label(row))).collect();
        rows.sort_unstable();
        rows
    };
    assert_eq!(sorted(&city), sorted(&coarse));

    succeeded(&train_block(&place, "b000", &[]));
    // Of another block, and of other settings.
    copy(&place.path("models/b000"), &place.path("models/b001"));
    assert!(stderr(&merge(&place, &[])).contains("another block or split"));
    std::fs::remove_dir_all(place.path("models/b001")).expect("removed");
    succeeded(&train_block(&place, "b001", &["--set", "sh_degree=1"]));
    let text = stderr(&merge(&place, &[]));
    assert!(text.contains("sh degree is 1, and 3 in"), "{text}");
    // One label with two names.
    let table = place.path("models/b000/labels.json");
    let renamed = std::fs::read_to_string(&table).expect("text").replace("\"ball\"", "\"globe\"");
    std::fs::write(&table, renamed).expect("written");
    let text = stderr(&merge(&place, &[]));
    assert!(text.contains("label 2 is ball, elsewhere globe") && text.contains("problems"), "{text}");
    // Stopped before its end: the metrics of a run tell.
    let metrics = place.path("models/b000/metrics.json");
    let changed = std::fs::read_to_string(&metrics).expect("text").replace("\"steps\": 60", "\"steps\": 7");
    std::fs::write(&metrics, changed).expect("written");
    assert!(stderr(&merge(&place, &[])).contains("stopped after 7 of 60 steps"));
}

#[test]
fn a_block_is_trained_with_its_scene_only() {
    let Some(_turn) = device() else { return };
    let place = split();
    let block = place.text("blocks/b000");
    let refused = |flags: &[&str]| stderr(&place.trained("refused", flags));
    assert!(refused(&["--block", &place.text("scene")]).contains("is not a folder of a block"));
    assert!(refused(&["--block", &block, "--init", &place.text("coarse")]).contains("cannot be used with"));
    succeeded(&train_block(&place, "b000", &["--checkpoint-every", "10"]));
    let other = place.text("blocks/b001");
    let again = place.trained("models/b000", &["--block", &other, "--resume", "--iterations", "130"]);
    assert!(stderr(&again).contains("contains a run of block b000"), "{}", stderr(&again));
    // Exposures of the coarse training stay as they are.
    let folder = place.path("blocks/b001");
    let file = BlockFile::read(&folder).expect("a block");
    let with = |matrix: [[f32; 3]; 3]| {
        let exposures = BTreeMap::from([(file.views[0].clone(), matrix)]);
        BlockFile { exposures, ..file.clone() }.write(&folder).expect("written");
    };
    with([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(stderr(&train_block(&place, "b001", &[])).contains("is not a valid exposure matrix"));
    let matrix = [[1.25, 0.0, 0.05], [0.1, 0.9, 0.0], [0.0, 0.0, 0.8]];
    with(matrix);
    succeeded(&train_block(&place, "b001", &[]));
    let found = &json(&place.path("models/b001/exposures.json"))["matrices"];
    let of = |name: &str| serde_json::from_value::<[[f32; 3]; 3]>(found[name].clone()).expect("a matrix");
    let found = of(&file.views[0]);
    assert!(found.as_flattened().iter().zip(matrix.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
    assert_eq!(of(&file.views[1]), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    // A scene whose camera moved.
    let poses = place.path("scene/sparse/0/images.bin");
    let mut bytes = std::fs::read(&poses).expect("poses");
    // After the number of images and an id: the first number of a rotation.
    bytes[12..20].copy_from_slice(&0.5_f64.to_le_bytes());
    std::fs::write(&poses, bytes).expect("written");
    assert!(refused(&["--block", &block]).contains("other poses than when it was split"));
}
