//! Models that are larger than the memory of the device are drawn as they are on a device with the memory; ids of
//! models beyond those of masks.

use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use crate::support::scenes::{Shape, camera, gaussians, generator};
use exr::prelude::read_first_flat_layer_from_file;
use glam::{DMat3, DVec3};
use labelgs::edit;
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::formats::{LazyModel, ModelRef, read_model, write_model};
use labelgs::gpu::Gpu;
use labelgs::render::large::{GaussianIndex, Painter, fits};
use labelgs::render::{Parts, Render, RenderOptions, label_map, render};
use labelgs::scene::{Camera, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use rand::Rng;
use std::path::Path;

const IMAGE_SIZE: (u32, u32) = (61, 45);

/// Gaussians all around the cameras: small ones, large ones and needles, at the borders of views and around near
/// planes.
fn crowd(count: usize) -> Gaussians {
    let mut random = generator(5);
    let shape = Shape { gaussians: count, sh_degree: 1, objects: 9, scales: (0.005, 0.3), ..Shape::default() };
    let mut model = gaussians(&mut random, &shape);
    model.means.iter_mut().flatten().for_each(|value| *value *= 5.0);
    for scale in model.scales.iter_mut().step_by(11) {
        scale[random.random_range(0..3)] += 3.0;
    }
    model
}

/// Cameras in the crowd, which look to all sides.
fn cameras() -> Vec<Camera> {
    let (mut random, (width, height)) = (generator(6), IMAGE_SIZE);
    let turned = |index: usize| {
        let camera = camera(&mut random, width, height);
        Camera { rotation: camera.rotation * DMat3::from_rotation_y(index as f64 * 1.3), ..camera }
    };
    (0..5).map(turned).collect()
}

fn limited(memory_limit: u64) -> SchedulerOptions {
    SchedulerOptions { memory_limit: Some(memory_limit), ..SchedulerOptions::default() }
}

/// The least memory for so many labelled Gaussians in pictures of a size, bytes.
fn memory_of(gpu: &Gpu, count: u64, image: (u32, u32)) -> u64 {
    let size = EngineSize::new(count, image).with_labels(Some(LabelSize::default()));
    let (mut low, mut high) = (0, 1 << 32);
    while low + 1 < high {
        let middle = (low + high) / 2;
        if Engine::predict(gpu, &size, limited(middle)).is_ok() { high = middle } else { low = middle }
    }
    high
}

fn floats(drawn: &Render) -> Vec<f64> {
    let all = drawn.rgb.as_flattened().iter().chain(&drawn.alpha).chain(&drawn.depth).chain(&drawn.top_weight);
    all.map(|&value| f64::from(value)).collect()
}

/// No Gaussian is lost at a border of a view: with memory for the whole picture the bits are those of the whole model,
/// and in bands the picture is that of the whole one but for rounding.
#[test]
fn views_of_a_large_model_are_those_of_the_whole() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("crowd.ply");
    write_model(&path, &crowd(4000)).expect("written");
    let whole = read_model(&path).expect("read").gaussians;
    let stored = LazyModel::open(&path).expect("opened");
    assert!(matches!(stored, LazyModel::Stored(_)));
    let mut engine = Engine::for_model(turn.gpu(), &whole, [IMAGE_SIZE]).expect("an engine");
    let options = RenderOptions::default();
    let expected: Vec<Render> =
        cameras().iter().map(|camera| render(&mut engine, camera, &options).expect("a picture")).collect();
    // A fifth of the model and a third of the picture.
    let little = limited(memory_of(&turn, 800, (IMAGE_SIZE.0, 16)));
    assert!(!fits(&turn, stored.view(), IMAGE_SIZE, little).expect("an answer"));
    for source in [stored.view(), ModelRef::Whole(&whole)] {
        let (index, notes) = GaussianIndex::new(source, 0.0, |_, _| true).expect("an index");
        assert_eq!(notes, Vec::<String>::new());
        let mut roomy = Painter::new(turn.gpu(), source, index.clone(), SchedulerOptions::default());
        let mut tight = Painter::new(turn.gpu(), source, index, little);
        for (camera, expected) in cameras().iter().zip(&expected) {
            assert!(expected.alpha.iter().sum::<f32>() > 0.5 * expected.alpha.len() as f32, "something to see");
            assert!(roomy.render(camera, &options).expect("a picture") == *expected, "the same bits");
            let found = tight.render(camera, &options).expect("a picture");
            check("bands", close(&floats(&found), &floats(expected), Tolerance { absolute: 2e-5, relative: 2e-5 }));
            check("main Gaussians", exact(&found.top_id, &expected.top_id));
            check("labels", exact(&found.labels, &expected.labels));
        }
    }
    // A control: were reaches a fifth smaller, Gaussians at borders would be lost.
    let mut small = whole.clone();
    small.scales.iter_mut().flatten().for_each(|scale| *scale -= 0.2);
    let (index, _) = GaussianIndex::new((&small).into(), 0.0, |_, _| true).expect("an index");
    let mut careless = Painter::new(turn.gpu(), (&whole).into(), index, SchedulerOptions::default());
    let differ = |(camera, expected): (&Camera, &Render)| careless.render(camera, &options).expect("one") != *expected;
    assert!(cameras().iter().zip(&expected).any(differ));
    // Not even a row of tiles.
    let (index, _) = GaussianIndex::new(stored.view(), 0.0, |_, _| true).expect("an index");
    let mut painter = Painter::new(turn.gpu(), stored.view(), index, limited(memory_of(&turn, 1, (8, 8))));
    let error = painter.render(&cameras()[0], &options).expect_err("too little memory");
    assert!(error.is_out_of_memory() && error.to_string().contains("that may show"), "{error}");
}

/// One object alone, and without those that are not sure.
#[test]
fn objects_of_a_large_model_are_drawn_alone() {
    let Some(turn) = device() else { return };
    let mut model = crowd(1500);
    model.label_confidence = Some((0..model.len()).map(|row| (row % 10) as f32 / 10.0).collect());
    let (index, _) = GaussianIndex::new((&model).into(), 0.6, |_, _| true).expect("an index");
    let mut painter = Painter::new(turn.gpu(), (&model).into(), index, SchedulerOptions::default());
    let (camera, options) = (&cameras()[1], RenderOptions::new(0.2, Parts::COLOUR));
    for label in [2, 7] {
        let part = edit::extract(&model, &[label], 0.6).expect("an object");
        let mut engine = Engine::for_model(turn.gpu(), &part, [IMAGE_SIZE]).expect("an engine");
        assert!(painter.show(Some(&[label])));
        let found = painter.render(camera, &options).expect("a picture");
        assert!(found == render(&mut engine, camera, &options).expect("a picture"), "label {label}");
    }
    assert!(!painter.show(Some(&[77])));
    // A view of nothing.
    assert!(painter.render(camera, &options).expect("a picture").alpha.iter().all(|&alpha| alpha == 0.0));
}

/// An id beyond those of masks, in the order of small ones.
fn wide(label: u32) -> u32 {
    [0, 7, 65_535, 65_536, 70_000, 16_777_217, 99_999_999, 2_147_483_645, 2_147_483_646, 2_147_483_647][label as usize]
}

#[test]
fn large_ids_are_drawn_as_small_ones() {
    let Some(turn) = device() else { return };
    let small = crowd(600);
    let mut large = small.clone();
    large.labels.iter_mut().flatten().for_each(|label| *label = wide(*label));
    let (camera, options) = (&cameras()[0], RenderOptions::default());
    let mut engine = Engine::for_model(turn.gpu(), &small, [IMAGE_SIZE]).expect("an engine");
    let expected = render(&mut engine, camera, &options).expect("a picture");
    engine.upload_model(&large).expect("uploaded");
    let found = render(&mut engine, camera, &options).expect("a picture");
    let labels: Vec<u32> = expected.labels.iter().map(|&label| wide(label)).collect();
    assert!(labels.iter().any(|&label| label > 65_535) && found.labels == labels);
    assert!(Render { labels, ..expected.clone() } == found);
    assert!(engine.labels().expect("labels") == large.labels.clone().expect("labels"));
    assert_eq!(engine.download_model().expect("a model").labels, large.labels);
    let of_main = found.main_label_map(large.labels.as_ref().expect("labels")).expect_err("beyond masks");
    for error in
        [of_main, found.label_map().expect_err("beyond"), label_map(&mut engine, camera, 0.2).expect_err("too")]
    {
        assert!(error.to_string().contains("have ids up to 65535"), "{error}");
    }
    engine.set_labels(small.labels.as_ref().expect("labels")).expect("set");
    assert!(render(&mut engine, camera, &options).expect("a picture") == expected);
}

/// More labels than one picture tells apart are drawn in bands that have fewer.
#[test]
fn more_labels_than_a_device_tells_apart_are_drawn_in_bands() {
    const WALL: u32 = 500_000;
    let Some(turn) = device() else { return };
    let mut model = crowd(90_000);
    model.scales.iter_mut().flatten().for_each(|scale| *scale -= 4.0);
    model.means.iter_mut().for_each(|mean| mean[2] = mean[2].abs() + 3.0);
    model.labels = Some((0..90_000).map(|row| 100_000 + row).collect());
    // A wall of some layers before all of them: tiles have few labels that count.
    for (layer, x, y) in (0..4).flat_map(|z| (-9..=9).flat_map(move |x| (-7..=7).map(move |y| (z, x, y)))) {
        model.means.push([x as f32 * 0.5, y as f32 * 0.5, 1.5 + 0.1 * layer as f32]);
        model.quats.push([1.0, 0.0, 0.0, 0.0]);
        model.scales.push([0.5_f32.ln(); 3]);
        model.opacities.push(6.0);
        model.sh0.push([0.5; 3]);
        model.sh_rest.extend([[0.0; 3]; 3]);
        model.labels.as_mut().expect("labels").push(WALL);
    }
    let error = Engine::for_model(turn.gpu(), &model, [IMAGE_SIZE]).err().expect("too many labels").to_string();
    assert!(error.contains("90001 different labels"), "{error}");
    let (index, _) = GaussianIndex::new((&model).into(), 0.0, |_, _| true).expect("an index");
    let mut painter = Painter::new(turn.gpu(), (&model).into(), index, SchedulerOptions::default());
    let camera = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        fx: 15.0,
        fy: 15.0,
        cx: 30.0,
        cy: 22.0,
        ..cameras()[0].clone()
    };
    let found = painter.render(&camera, &RenderOptions::default()).expect("a picture");
    assert!(found.labels.iter().all(|&label| label == WALL) && found.top_id.iter().all(|&row| row >= 90_000));
}

/// The command line: the same files with and without the memory, and ids beyond those of masks in every command.
#[test]
fn commands_take_large_models_and_large_ids() {
    let Some(turn) = device() else { return };
    let place = Place::new();
    let [scene, masks, path] = ["scene", "scene/masks", "model.ply"].map(|name| place.text(name));
    let mut model = crowd(6000);
    model.labels.iter_mut().flatten().for_each(|label| *label = if *label == 9 { 70_000 } else { *label });
    write_model(&path, &model).expect("written");
    let model = read_model(&path).expect("read").gaussians;
    let limit = format!("{}K", memory_of(&turn, 3500, (64, 48)).div_ceil(1024));
    drop(turn);
    let Some(_turn) = device() else { return };
    let what = ["--what", "rgb,labels,top-id", "--format", "exr", "--views", "all"];
    let draw = |out: &str, flags: &[&str]| {
        let args = ["-v", "render", &path, "--scene", &scene, "-o", &place.text(out)];
        let said = succeeded(&place.labelgs(&[&args[..], &what, flags].concat()));
        assert_eq!(said.contains("only the Gaussians in view are loaded"), flags.contains(&"--memory-limit"), "{said}");
    };
    for (name, only) in
        [("all", vec![]), ("only", vec!["--only", "1-4,70000"]), ("without", vec!["--without", "70000"])]
    {
        let (whole, parts) = (format!("{name}-whole"), format!("{name}-parts"));
        draw(&whole, &only);
        draw(&parts, &[&only[..], &["--memory-limit", &limit]].concat());
        let labels = if name == "without" { "000.labels.png" } else { "000.labels.exr" };
        for file in ["000.top-id.exr", "000.labels-colour.png", labels] {
            let bytes = |out: &str| std::fs::read(place.path(out).join(file)).expect("a picture");
            assert!(bytes(&whole) == bytes(&parts), "{name}: {file}");
        }
    }
    let ids = read_first_flat_layer_from_file(place.path("all-whole/000.labels.exr")).expect("EXR");
    let ids = &ids.layer_data.channel_data.list[0].sample_data;
    assert!(matches!(ids, exr::prelude::FlatSamples::U32(ids) if ids.contains(&70_000)));
    let png = ["render", &path, "--scene", &scene, "--what", "labels", "-o", &place.text("png")];
    let output = place.labelgs(&png);
    let said = stderr(&output);
    assert!(output.status.code() == Some(2) && said.contains("label 70000") && said.contains("--format exr"), "{said}");

    // Streams give what the library makes of the whole model.
    let listed = place.labelgs(&["list", &path, "--json"]);
    succeeded(&listed);
    let mut listed: serde_json::Value = serde_json::from_slice(&listed.stdout).expect("JSON");
    for row in listed["labels"].as_array_mut().expect("rows") {
        // Along the axes of the object; the library has it elsewhere.
        assert!(row.as_object_mut().expect("a row").remove("oriented").is_some());
    }
    assert_eq!(listed["labels"], serde_json::to_value(edit::summarise(&model)).map(named).expect("JSON"));
    assert_eq!(listed["gaussians"], model.len());
    let edits: [(&str, &[&str], Gaussians); 2] = [
        ("extract", &["--labels", "3,70000"], edit::extract(&model, &[3, 70_000], 0.6).expect("a part")),
        ("remove", &["--labels", "70000"], edit::remove(&model, &[70_000]).expect("a rest")),
    ];
    for (command, flags, expected) in edits {
        let out = place.text(&format!("{command}.ply"));
        succeeded(&place.labelgs(&[&[command, &path, "-o", &out], flags].concat()));
        write_model(place.path("expected.ply"), &expected).expect("written");
        let bytes = |path: &Path| std::fs::read(path).expect("a model");
        assert!(bytes(&place.path("expected.ply")) == bytes(Path::new(&out)), "{command}");
    }
    for (map, label) in [("70000=2147483647", 2_147_483_647_u32), ("70000=9", 9)] {
        let out = place.text("relabelled.ply");
        succeeded(&place.labelgs(&["relabel", &path, "--map", map, "--label-type", "uint", "-o", &out]));
        assert!(read_model(&out).expect("read").gaussians.labels.expect("labels").contains(&label), "{map}");
    }
    let relabelled = place.text("relabelled.ply");
    let scores = |flags: &[&str]| -> f64 {
        let eval = ["eval", &relabelled, "--scene", &scene, "--masks", &masks, "--json"];
        let output = place.labelgs(&[&eval[..], flags].concat());
        succeeded(&output);
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        found["mean"]["psnr"].as_f64().expect("a score") + found["mean"]["iou_object"].as_f64().unwrap_or_default()
    };
    assert!((scores(&[]) - scores(&["--memory-limit", &limit])).abs() < 1e-4);
    let output =
        place.labelgs(&["eval", &path, "--scene", &scene, "--removal", "--masks", &masks, "--memory-limit", &limit]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--removal"), "{}", stderr(&output));
}

/// Rows of `list` have a name, too.
fn named(mut rows: serde_json::Value) -> serde_json::Value {
    for row in rows.as_array_mut().into_iter().flatten() {
        row["name"] = serde_json::Value::Null;
    }
    rows
}
