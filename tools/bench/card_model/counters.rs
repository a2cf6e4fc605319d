//! The bytes of the formulas against counters: one step of a small training with kernels that count the sectors that
//! they touch, in the shape that cards have, with subgroups emulated.

use super::instrument::counting;
use super::kernels;
use super::scene::{Counts, SECTOR};
use super::step::{Subject, items};
use super::{Common, Compiler};
use crate::compiler::shader;
use crate::device;
use crate::measure::{require, table};
use crate::trained::{TEST_EVERY, start, timing_config, without_masks};
use labelgs::gpu::GpuOptions;
use labelgs::internals::pass::{KernelShape, Stage, Variant, training_step};
use labelgs::internals::scheduler::plan::{
    Buf, BufferDecl, Class, Domain, Grid, PassDecl, PassList, Plan, PlanOptions, TABLE, Work,
};
use labelgs::internals::scheduler::{Scheduler, SchedulerOptions};
use labelgs::internals::shaders::structs::Counters;
use labelgs::internals::synth;
use labelgs::internals::train::{Trainer, TrainerOptions};
use labelgs::run::TrainConfig;
use labelgs::scene::Gaussians;
use labelgs::synth::SynthOptions;
use labelgs::{Error, Result};
use rand::{Rng, SeedableRng};
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};

/// Greatest difference of the formulas from the counters, of the whole step and of each stage with a hundredth of its
/// bytes.
const TOLERANCE: f64 = 0.10;

/// Cells of a pass: for each binding, sectors read and sectors written.
const CELLS: u32 = 64;

/// Bytes by pass and binding: read, written.
type Counted = Vec<Vec<(&'static str, f64, f64)>>;

/// Compares formulas and counters, without and with objects.
pub fn check(common: &Common, compiler: &Compiler) -> Result<Value> {
    let mut found = Vec::new();
    // A step with objects has every kind of pass.
    let cases: &[bool] = if common.small { &[true] } else { &[false, true] };
    for &labels in cases {
        found.push(compare(common, compiler, labels)?);
    }
    Ok(json!(found))
}

fn compare(common: &Common, compiler: &Compiler, labels: bool) -> Result<Value> {
    let measured = measure(common, labels)?;
    let c = &measured.counts;
    println!(
        "\ncounters: {} Gaussians, {} x {} px, {} objects: {} visible, {} pairs, {:.0} % of them walked, \
         {:.0} % up to the last weight; {} tiles of the largest splat, {} pairs in the longest list, divergence {:.1}",
        c.gaussians,
        c.width,
        c.height,
        c.layers,
        c.visible,
        c.instances,
        c.walked_share() * 100.0,
        c.weighted / c.instances * 100.0,
        c.largest_splat,
        c.longest_list,
        c.divergence
    );
    let mut stages: BTreeMap<Stage, (f64, f64)> = BTreeMap::new();
    let mut wrong: Vec<(f64, String)> = Vec::new();
    let mut passes = measured.counted.iter();
    for item in &measured.items {
        if item.pass.is_none() {
            continue;
        }
        let (_, touches) = kernels::work(item, c, compiler)?;
        let counted = passes.next().ok_or_else(|| Error::Bug("a pass was not counted".to_owned()))?;
        for (touch, (name, read, written)) in touches.iter().zip(counted) {
            require(touch.binding == *name, || format!("{name} was counted for {}", touch.binding))?;
            let entry = stages.entry(item.stage).or_default();
            *entry = (entry.0 + touch.read + touch.written, entry.1 + read + written);
            let text = format!(
                "{} {name}: read {:.0}, counted {read:.0}; written {:.0}, counted {written:.0}",
                item.title, touch.read, touch.written
            );
            wrong.push(((touch.read - read).abs() + (touch.written - written).abs(), text));
        }
    }
    let all = stages.values().fold((0.0, 0.0), |sum, bytes| (sum.0 + bytes.0, sum.1 + bytes.1));
    let mut rows = vec![["stage", "formulas, kB", "counters, kB", "ratio"].map(str::to_owned).to_vec()];
    let row = |name: &str, (ours, counted): (f64, f64)| {
        vec![
            name.to_owned(),
            format!("{:.1}", ours / 1e3),
            format!("{:.1}", counted / 1e3),
            format!("{:.3}", ours / counted),
        ]
    };
    rows.extend(stages.iter().map(|(stage, bytes)| row(stage.name(), *bytes)));
    rows.push(row("step", all));
    println!("{}", table(&rows));
    wrong.sort_by(|a, b| b.0.total_cmp(&a.0));
    let worst: Vec<&str> = wrong.iter().take(6).map(|(_, text)| text.as_str()).collect();
    println!("largest differences, bytes:\n  {}", worst.join("\n  "));
    let off = |(ours, counted): (f64, f64)| (ours / counted - 1.0).abs() > TOLERANCE;
    for (name, bytes) in stages.iter().map(|(stage, bytes)| (stage.name(), *bytes)).chain([("step", all)]) {
        require(bytes.1 < 0.01 * all.1 || !off(bytes), || {
            format!("the formulas give {} the {:.3} fold of the counted bytes", name, bytes.0 / bytes.1)
        })?;
    }
    let stages: Vec<Value> = stages
        .iter()
        .map(|(stage, bytes)| json!({ "stage": stage.name(), "formulas": bytes.0, "counters": bytes.1 }))
        .collect();
    Ok(json!({ "counts": c, "stages": stages, "formulas": all.0, "counters": all.1 }))
}

/// A counted step.
struct Measured {
    items: Vec<super::step::Item>,
    counts: Counts,
    counted: Counted,
}

fn measure(common: &Common, labels: bool) -> Result<Measured> {
    let scene = if common.small {
        SynthOptions { width: 160, height: 120, views: 9, points: 1500, ..SynthOptions::default() }
    } else {
        SynthOptions { width: 480, height: 360, views: 16, points: 12_000, ..SynthOptions::default() }
    };
    let dataset = synth::dataset(&scene, TEST_EVERY);
    let dataset = if labels { dataset } else { without_masks(&dataset) };
    let gpu =
        device::open_as(&GpuOptions { subgroup_size: Some(32), emulate_subgroups: true, ..GpuOptions::from_env()? })?;
    let shape = KernelShape { emulated: true, ..Subject::shape() };
    let config = TrainConfig { label_samples: 4, layer_every: Some(1), ..timing_config() };
    let options = TrainerOptions { shape: Some(shape), ..TrainerOptions::default() };
    let mut model = start(&dataset, &config)?;
    make_sparse(&mut model);
    let mut trainer = Trainer::new(gpu.clone(), config, &dataset, &model, options)?;
    for _ in 0..4 {
        trainer.step()?;
    }
    trainer.drain()?;
    let engine = trainer.engine_mut();
    let capacity = *engine.raw().capacity();
    let size = (scene.width, scene.height);
    let variant = Variant { labels, ..Variant::plain(size) };
    let list = training_step(&shape, &capacity, variant);
    let plan_options = PlanOptions { alias: false, ..PlanOptions::default() };
    let limits = SchedulerOptions::default().limits(&gpu);
    let items = items(&list, &Plan::new(TABLE, &capacity, &list, &limits, plan_options)?)?;

    let own = Bits::new(&list, engine.raw())?;
    let options = SchedulerOptions { plan: plan_options, ..SchedulerOptions::default() };
    let mut sched = Scheduler::new(gpu.clone(), own.table, capacity, options)?;
    for index in 0..TABLE.len() {
        let buf = Buf(index as u16);
        let words = engine.raw().bytes(buf)? as usize / 4;
        let some = capacity.count(TABLE[index].domain) > 0;
        if some && !matches!(TABLE[index].class, Class::Step | Class::Report) {
            let data = engine.raw_mut().download::<u32>(buf, 0, 0, words)?;
            sched.upload(buf, 0, 0, &data)?;
        }
    }
    let id = sched.prepare(&own.list)?;
    sched.run(id, 0)?;
    let report = sched.download::<Counters>(Buf::REPORT, 0, 0, 1)?[0];
    let failure = sched.download::<u32>(Buf::REPORT_FAILURE, 0, 0, 1)?[0];
    require(failure == 0, || format!("the counted step failed: {failure}"))?;
    let touched = sched.download::<u32>(Buf::TILES_TOUCHED, 0, 0, report.visible_count as usize)?;
    let last = sched.download::<u32>(Buf::LAST, 0, 0, (scene.width * scene.height) as usize)?;
    let virtual_tiles = capacity.virtual_tiles as usize;
    let starts = sched.download::<u32>(Buf::TILE_STARTS, 0, 0, virtual_tiles)?;
    let ends = sched.download::<u32>(Buf::TILE_ENDS, 0, 0, virtual_tiles)?;
    let lists: Vec<u32> = ends.iter().zip(&starts).map(|(end, start)| end - start).collect();
    let counted = own.read(&mut sched, &list)?;
    let counts = counts(&Ran { report, touched, last, lists }, &shape, trainer.gaussian_count(), &scene);
    Ok(Measured { items, counts, counted })
}

/// What the counted step left behind.
struct Ran {
    report: Counters,
    /// Tiles of each splat.
    touched: Vec<u32>,
    /// Last pair with a weight, by pixel.
    last: Vec<u32>,
    /// Pairs of each tile of each layer.
    lists: Vec<u32>,
}

/// Hides a random half of the model, as a view of a large scene does, and makes the rest so opaque that tiles stop early.
fn make_sparse(model: &mut Gaussians) {
    let mut random = rand::rngs::SmallRng::seed_from_u64(1);
    for opacity in &mut model.opacities {
        *opacity = if random.random_bool(0.5) { -20.0 } else { 4.0 };
    }
    for scale in model.scales.iter_mut().flatten() {
        *scale += 0.7;
    }
}

/// Counts of the step that ran.
fn counts(ran: &Ran, shape: &KernelShape, gaussians: u32, scene: &SynthOptions) -> Counts {
    let report = &ran.report;
    let (tiles_x, tiles_y) = shape.tiles(scene.width, scene.height);
    let tiles = (tiles_x * tiles_y) as usize;
    let most: Vec<f64> =
        ran.touched.chunks(32).map(|group| f64::from(group.iter().copied().max().unwrap_or(0))).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (visible, instances) = (f64::from(report.visible_count), f64::from(report.instance_count));
    let walked = report.walked_splats() as f64;
    let mut deepest = vec![0_u32; tiles];
    for (pixel, &last) in ran.last.iter().enumerate() {
        let (x, y) = (pixel as u32 % scene.width, pixel as u32 / scene.width);
        let tile = &mut deepest[((y / shape.tile_height) * tiles_x + x / shape.tile_width) as usize];
        *tile = last.max(*tile);
    }
    let (first, objects) = ran.lists.split_at(tiles);
    let pairs = |lists: &[u32]| lists.iter().map(|&length| f64::from(length)).sum::<f64>();
    // The layers' own depths are packed with other bits: the same share of their pairs is taken.
    let weighted = deepest.iter().map(|&last| f64::from(last)).sum::<f64>() * instances / pairs(first).max(1.0);
    let has_object = |tile: &usize| objects.iter().skip(*tile).step_by(tiles).any(|&length| length > 0);
    Counts {
        gaussians: f64::from(gaussians),
        visible,
        instances,
        walked,
        weighted: weighted.min(walked),
        largest_splat: f64::from(ran.touched.iter().copied().max().unwrap_or(0)),
        divergence: mean(&most) / (instances / visible.max(1.0)),
        longest_list: f64::from(report.longest_list),
        width: f64::from(scene.width),
        height: f64::from(scene.height),
        tiles: tiles as f64,
        tile_pixels: f64::from(shape.tile_pixels()),
        layers: (ran.lists.len() / tiles) as f64 - 1.0,
        layer_tiles: f64::from(report.layer_tile_count),
        object_tiles: (0..tiles).filter(has_object).count() as f64,
        // For rounds and chains only; the bytes do not depend on it.
        layer_visible: 0.0,
    }
}

/// The list with counting kernels, and the buffers of their bits.
struct Bits {
    table: &'static [BufferDecl],
    list: PassList,
    counts: Buf,
}

impl Bits {
    fn new(list: &PassList, sched: &Scheduler) -> Result<Self> {
        let passes = list.work.iter().filter(|work| matches!(work, Work::Pass(_))).count() as u32;
        let mut bytes = 0;
        for index in 0..TABLE.len() {
            bytes = sched.bytes(Buf(index as u16))?.max(bytes);
        }
        // Whole workgroups of the counting pass for each cell.
        let words = ((bytes as f64 / SECTOR / 32.0).ceil() as u32 + 1).next_multiple_of(64);
        let row = |name, elements| BufferDecl {
            name,
            element_bytes: 4,
            domain: Domain::Fixed(elements),
            class: Class::Persistent,
            texel: None,
            doc: "A benchmark's.",
        };
        let own = [row("sectors", words * CELLS), row("counts", passes * CELLS)];
        let table = TABLE.iter().copied().chain(own).collect::<Vec<_>>().leak();
        let (sectors, counts) = (Buf(TABLE.len() as u16), Buf(TABLE.len() as u16 + 1));
        let counter = shader("sectors", include_str!("sectors.comp"), false)?;
        let mut made: HashMap<&str, _> = HashMap::new();
        let mut out = PassList::new("counted step");
        let mut first = 0;
        for work in &list.work {
            let Work::Pass(pass) = work else {
                out.work.push(work.clone());
                continue;
            };
            let kernel = match made.get(pass.shader.name) {
                Some(kernel) => *kernel,
                None => counting(pass.shader, words)?,
            };
            made.insert(pass.shader.name, kernel);
            let buffers = pass.buffers.iter().copied().chain([sectors]).collect();
            out.work.push(Work::Pass(PassDecl { shader: kernel, buffers, ..pass.clone() }));
            let used = 2 * pass.buffers.len() as u32;
            require(used <= CELLS, || format!("{} has more than {} bindings", pass.label, CELLS / 2))?;
            let grid = Grid::Groups(used * words / 64, 1, 1);
            out.pass(PassDecl::new(counter, vec![sectors, counts], grid).spec(vec![words, first]));
            first += CELLS;
        }
        Ok(Self { table, list: out, counts })
    }

    /// Bytes by pass of the plain list.
    fn read(&self, sched: &mut Scheduler, list: &PassList) -> Result<Counted> {
        let passes = list.work.iter().filter_map(|work| if let Work::Pass(pass) = work { Some(pass) } else { None });
        let mut found = Vec::new();
        for (index, pass) in passes.enumerate() {
            let cells = sched.download::<u32>(self.counts, 0, index as u64 * u64::from(CELLS), CELLS as usize)?;
            let cells: Vec<f64> = cells.iter().map(|&count| f64::from(count) * SECTOR).collect();
            let rows = pass.shader.bindings.iter().zip(cells.chunks(2));
            found.push(rows.map(|(binding, bytes)| (binding.name, bytes[0], bytes[1])).collect());
        }
        Ok(found)
    }
}
