//! The most that skips would save which are not built, so that it is known what is left on the table.
//!
//! Steps with and without labels run in turn from one model, and each skip is given all of the time that it could ever
//! touch. What a skip would itself cost is not counted.

use super::measure::{self, median, require, table, write_json};
use super::pace::{Pace, race};
use super::trained::{TEST_EVERY, labelled_model, without_masks};
use super::{Common, device};
use labelgs::Result;
use labelgs::edit::select::{extract, summarise};
use labelgs::engine::{Engine, EngineSize};
use labelgs::gpu::Gpu;
use labelgs::pass::Stage;
use labelgs::render::{Parts, RenderOptions, Rendered, render};
use labelgs::scene::{Camera, Dataset, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{self, SynthOptions};
use serde::Serialize;
use std::sync::Arc;

/// A skip, and the most that it saves.
#[derive(Debug, Serialize)]
struct Row {
    skip: &'static str,
    /// What is known about it.
    because: String,
    /// Share of a step without labels, or with them where it is about objects.
    most: f64,
}

/// Runs it.
pub fn run(common: &Common) -> Result<()> {
    let (options, training, timed, shown) = if common.small {
        (SynthOptions { width: 48, height: 40, views: 9, ..Default::default() }, 30, 2, 1)
    } else {
        (SynthOptions::default(), 1500, 60, 5)
    };
    let gpu = device::open()?;
    let dataset = synth::dataset(&options, TEST_EVERY);
    let model = labelled_model(&gpu, &dataset, training)?;
    let mut paces = [
        Pace::new("plain step", &gpu, without_masks(&dataset), &model, 0)?,
        Pace::new("labels", &gpu, dataset.clone(), &model, 10)?,
    ];
    race(&mut paces, timed)?;
    let [plain, labels] = &paces;
    let served = served_tiles(&gpu, &dataset, &model, shown)?;
    let rows = rows(plain, labels, model.len(), served);
    println!(
        "{}, load {:.1}; {} x {} px, {} Gaussians, {timed} steps in turn\n",
        gpu.capabilities().name,
        measure::load().unwrap_or(f64::NAN),
        options.width,
        options.height,
        model.len()
    );
    let mut text = vec![["skip", "most of a step"].map(str::to_owned).to_vec()];
    let cells = |row: &Row| vec![format!("{}: {}", row.skip, row.because), format!("{:.1} %", row.most * 100.0)];
    text.extend(rows.iter().map(cells));
    println!("{}", table(&text));
    require(rows.iter().all(|row| (0.0..1.0).contains(&row.most)), || "a share makes no sense".to_owned())?;
    write_json(&common.output.join("skips.json"), &rows)
}

fn rows(plain: &Pace, labels: &Pace, gaussians: usize, served: Served) -> Vec<Row> {
    let whole = |pace: &Pace| median(pace.passes.iter().copied());
    let stage = |pace: &Pace, stage: Stage| pace.stages.get(&stage).map_or(0.0, |ms| median(ms.iter().copied()));
    let kernel = |name: &str| plain.kernels.get(name).map_or(0.0, |ms| median(ms.iter().copied()));
    let hidden = 1.0 - median(plain.splats.iter().copied()) / gaussians as f64;
    let out_of_sight = format!("{:.0} % of the Gaussians are out of sight in a step", hidden * 100.0);
    let culling: f64 = ["cull", "scan_reduce_flag", "scan_apply_flag", "compact"].map(kernel).iter().sum();
    let own = [Stage::Gather, Stage::ProjectBackward, Stage::Optimise].map(|of| stage(plain, of)).iter().sum::<f64>();
    let blends = |pace: &Pace| stage(pace, Stage::BlendForward) + stage(pace, Stage::BlendBackward);
    let objects = (blends(labels) - blends(plain)).max(0.0) / whole(labels);
    vec![
        Row {
            skip: "Gaussians culled in clusters",
            because: out_of_sight.clone(),
            most: culling * hidden / whole(plain),
        },
        Row {
            skip: "Adam where there is a gradient, caught up later",
            because: out_of_sight,
            most: stage(plain, Stage::Optimise) * hidden / whole(plain),
        },
        Row {
            skip: "converged Gaussians at rest",
            because: "if all were; they are still blended".to_owned(),
            most: own / whole(plain),
        },
        Row {
            skip: "object tiles served by the walk of the scene",
            because: format!("{:.1} % of {} tiles are the same bits", served.share() * 100.0, served.tiles),
            most: objects * served.share(),
        },
    ]
}

/// Tiles of objects.
#[derive(Clone, Copy, Default)]
struct Served {
    /// That an object reaches.
    tiles: u64,
    /// Of these, where the scene has the object's bits in every pixel: nothing else is in front or shines through.
    same: u64,
}

impl Served {
    fn share(self) -> f64 {
        self.same as f64 / self.tiles.max(1) as f64
    }
}

/// Compares objects on their own with the scene, in some views.
fn served_tiles(gpu: &Arc<Gpu>, dataset: &Dataset, model: &Gaussians, views: usize) -> Result<Served> {
    let cameras: Vec<&Camera> =
        dataset.test.iter().chain(&dataset.train).map(|view| &view.camera).take(views).collect();
    let size = cameras.first().map_or((1, 1), |camera| (camera.width, camera.height));
    let room = EngineSize::new(model.len() as u64, size);
    let mut engine = Engine::new(Arc::clone(gpu), room, SchedulerOptions::default())?;
    let tile = (engine.shape().tile_width as usize, engine.shape().tile_height as usize);
    let options = RenderOptions { parts: Parts::COLOUR, ..RenderOptions::default() };
    let mut pictures = |model: &Gaussians| -> Result<Vec<Rendered>> {
        engine.upload_model(model)?;
        cameras.iter().map(|camera| render(&mut engine, camera, &options)).collect()
    };
    let scene = pictures(model)?;
    let mut served = Served::default();
    for label in summarise(model).iter().map(|row| row.label).filter(|&label| label != 0) {
        let object = pictures(&extract(model, &[label], 0.0)?)?;
        for (scene, object) in scene.iter().zip(&object) {
            count(scene, object, tile, &mut served);
        }
    }
    Ok(served)
}

fn count(scene: &Rendered, object: &Rendered, (width, height): (usize, usize), served: &mut Served) {
    let columns = scene.width as usize;
    let bits = |of: &Rendered, at: usize| (of.rgb[at].map(f32::to_bits), of.alpha[at].to_bits());
    for y in (0..scene.height as usize).step_by(height) {
        for x in (0..columns).step_by(width) {
            let (right, below) = ((x + width).min(columns), (y + height).min(scene.height as usize));
            let pixels: Vec<usize> = (y..below).flat_map(|y| (x..right).map(move |x| y * columns + x)).collect();
            if pixels.iter().any(|&at| object.alpha[at] > 0.0) {
                served.tiles += 1;
                served.same += u64::from(pixels.iter().all(|&at| bits(scene, at) == bits(object, at)));
            }
        }
    }
}
