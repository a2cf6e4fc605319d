//! The cost of labels relative to the same steps without masks, by the area of the masks and by the number of objects:
//! for the steps, and for the whole labelled part of a run, with its votes and occluders.

use super::measure::write_json;
use super::pace::{Pace, race};
use super::trained::{TEST_EVERY, plain_model, without_masks};
use super::{Common, device};
use labelgs::Result;
use labelgs::engine::{Engine, EngineSize};
use labelgs::gpu::Gpu;
use labelgs::render::{NEAR_DEFAULT, RenderOptions, render};
use labelgs::scene::{Dataset, Gaussians};
use labelgs::scheduler::SchedulerOptions;
use labelgs::synth::{self, SynthOptions};
use serde_json::{Value, json};
use std::sync::Arc;

/// Steps with labels in a run of 3,000 steps.
const LABEL_STEPS: f64 = 1200.0;

/// Sizes of a run.
struct Size {
    /// Size of the training images.
    picture: (u32, u32),
    views: u32,
    training: u32,
    /// Timed steps per training; a multiple of the interval between steps with object layers.
    timed: usize,
    objects: [usize; 2],
}

/// Runs the benchmark.
pub fn run(common: &Common) -> Result<()> {
    let size = if common.small {
        Size { picture: (48, 40), views: 9, training: 20, timed: 8, objects: [3, 12] }
    } else {
        Size { picture: (320, 240), views: 40, training: 1500, timed: 64, objects: [10, 500] }
    };
    let gpu = device::open()?;
    let options =
        SynthOptions { width: size.picture.0, height: size.picture.1, views: size.views, ..Default::default() };
    let model = plain_model(&gpu, &options, size.training)?;
    let first = by_area(&gpu, &options, &model, size.timed)?;
    let second = by_number(&gpu, &options, &model, &size)?;
    write_json(
        &common.output.join("steps.json"),
        &json!({ "schema_version": 1, "by_area": first, "by_number": second }),
    )
}

/// Compares synthetic masks with masks that cover every pixel.
fn by_area(gpu: &Arc<Gpu>, options: &SynthOptions, model: &Gaussians, timed: usize) -> Result<Vec<Value>> {
    let made = synth::dataset(options, TEST_EVERY);
    let share = covered(&made)?;
    let mut whole = made.clone();
    let ground =
        1 + made.train.iter().filter_map(|view| view.mask.as_ref()).flat_map(|m| m.objects()).max().unwrap_or(0);
    for mask in whole.train.iter_mut().filter_map(|view| view.mask.as_mut()) {
        mask.edit(|mask| mask.ids.iter_mut().filter(|id| **id == 0).for_each(|id| *id = ground))?;
    }
    let paces = vec![
        Pace::new("no masks", gpu, without_masks(&made), model)?,
        Pace::new(&format!("masks cover {:.0} %", share * 100.0), gpu, made, model)?,
        Pace::new("masks cover everything", gpu, whole, model)?,
    ];
    table(paces, timed, (options.width, options.height))
}

/// Divides the same space among few and among many objects.
fn by_number(gpu: &Arc<Gpu>, options: &SynthOptions, model: &Gaussians, size: &Size) -> Result<Vec<Value>> {
    let made = synth::dataset(options, TEST_EVERY);
    let mut paces = vec![Pace::new("no masks", gpu, without_masks(&made), model)?];
    for objects in size.objects {
        let divided = divided(gpu, &made, model, objects)?;
        paces.push(Pace::new(&format!("{objects} objects"), gpu, divided, model)?);
    }
    table(paces, size.timed, (options.width, options.height))
}

/// Returns the share of pixels that belong to an object.
fn covered(dataset: &Dataset) -> Result<f64> {
    let (mut of_objects, mut all) = (0, 0);
    for mask in dataset.train.iter().filter_map(|view| view.mask.as_ref()) {
        let mask = mask.get()?;
        of_objects += mask.ids.iter().filter(|&&id| id != 0).count();
        all += mask.ids.len();
    }
    Ok(of_objects as f64 / all.max(1) as f64)
}

/// Returns masks of `objects` regions of space, which together cover the model.
fn divided(gpu: &Arc<Gpu>, dataset: &Dataset, model: &Gaussians, objects: usize) -> Result<Dataset> {
    let mut labels = vec![0; model.len()];
    let mut all: Vec<usize> = (0..model.len()).collect();
    divide(&mut all, &model.means, objects, &mut 1, &mut labels);
    let size = dataset.train.first().map_or((1, 1), |view| (view.camera.width, view.camera.height));
    let room = EngineSize::new(model.len() as u64, size);
    let mut engine = Engine::new(Arc::clone(gpu), room, SchedulerOptions::default())?;
    engine.upload_model(model)?;
    let mut dataset = dataset.clone();
    for view in &mut dataset.train {
        let seen = render(&mut engine, &view.camera, &RenderOptions::for_main(NEAR_DEFAULT))?;
        view.mask = Some(seen.main_label_map(&labels)?.into());
    }
    Ok(dataset)
}

/// Divides a set of Gaussians across its longest side, repeatedly, into parts of about equal counts.
fn divide(rows: &mut [usize], means: &[[f32; 3]], parts: usize, next: &mut u32, labels: &mut [u32]) {
    if parts <= 1 || rows.len() < 2 {
        rows.iter().for_each(|&row| labels[row] = *next);
        *next += 1;
        return;
    }
    let side = |axis: usize| {
        let values = rows.iter().map(|&row| means[row][axis]);
        values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
    };
    let axis = (0..3).max_by(|&a, &b| side(a).total_cmp(&side(b))).unwrap_or(0);
    let (left, at) = (parts / 2, rows.len() * (parts / 2) / parts);
    rows.select_nth_unstable_by(at, |&a, &b| means[a][axis].total_cmp(&means[b][axis]));
    let (low, high) = rows.split_at_mut(at);
    divide(low, means, left, next, labels);
    divide(high, means, parts - left, next, labels);
}

fn table(mut paces: Vec<Pace>, timed: usize, (width, height): (u32, u32)) -> Result<Vec<Value>> {
    race(&mut paces, timed)?;
    // Use a mean, because a few steps have object layers.
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let plain = (mean(&paces[0].passes), mean(&paces[0].processor), mean(&paces[0].pairs()));
    println!("{timed} steps of each in turn");
    paces.iter().for_each(|pace| println!("{}: {}", pace.name, pace.about().0));
    println!(
        "{:<24} {:>9} {:>7} {:>9} {:>9} {:>10} {:>9} {:>9} {:>12}",
        "", "passes ms", "ratio", "cpu ms", "ratio", "sweeps ms", "ratio", "pairs/px", "object/scene"
    );
    let mut rows = Vec::new();
    for pace in &mut paces {
        let sweeps = pace.sweeps()?;
        let (passes, processor, pairs) = (mean(&pace.passes), mean(&pace.processor), mean(&pace.pairs()));
        let (_, step) = pace.about();
        let (ratio, cpu_ratio, objects) = (passes / plain.0, processor / plain.1, pairs / plain.2 - 1.0);
        let phase_ratio = (LABEL_STEPS * processor + sweeps) / (LABEL_STEPS * plain.1);
        let per_pixel = pairs / (f64::from(width) * f64::from(height));
        println!(
            "{:<24} {passes:>9.2} {ratio:>7.2} {processor:>9.1} {cpu_ratio:>9.2} {sweeps:>10.0} {phase_ratio:>9.3} \
             {per_pixel:>9.1} {objects:>12.2}",
            pace.name
        );
        rows.push(json!({
            "name": pace.name, "step": step, "passes_ms": passes, "ratio": ratio,
            "processor_ms": processor, "processor_ratio": cpu_ratio, "sweeps_ms": sweeps, "phase_ratio": phase_ratio,
            "pipeline_ms": mean(&pace.wall), "pairs": pairs, "object_pairs_by_scene_pairs": objects,
        }));
    }
    println!(
        "the last ratio: {LABEL_STEPS} steps with the sweeps of votes and occluders, by {LABEL_STEPS} steps without masks\n"
    );
    Ok(rows)
}
