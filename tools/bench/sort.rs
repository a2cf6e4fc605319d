//! The sort alone, in each form that the device supports.

use crate::measure::{median, table, write_json};
use crate::{Common, device};
use bytemuck::Zeroable;
use labelgs::engine::{Engine, EngineSize};
use labelgs::gpu::Gpu;
use labelgs::pass::buffers::Capacity;
use labelgs::pass::build::Count;
use labelgs::pass::sort::{SortBuffers, digit_bits, sort};
use labelgs::pass::{Builder, KernelShape};
use labelgs::scheduler::SchedulerOptions;
use labelgs::scheduler::plan::{Buf, PlanOptions};
use labelgs::shaders::constants::{
    ARGS_SWEEP_INSTANCES, DEPTH_BITS, SWEEP_DIGITS, SWEEP_HISTOGRAMS, SWEEP_LANES, SWEEP_WORDS,
};
use labelgs::shaders::structs::{Counters, StepUniforms};
use labelgs::verify::selftest::scenes::generator;
use labelgs::{Error, Result};
use rand::Rng;
use serde_json::json;
use std::sync::Arc;

/// The same buffers are used for depth and tile keys; the sort starts in the first pair.
const KEY_BUFFERS: [Buf; 2] = [Buf::TILE_KEYS_A, Buf::TILE_KEYS_B];
const VALUE_BUFFERS: [Buf; 2] = [Buf::TILE_VALUES_A, Buf::TILE_VALUES_B];
/// Stores the keys of every run, because the sort overwrites its input.
const SOURCE_BUFFER: Buf = Buf::SPLAT_FROM_INSTANCE;
/// Stores the digits counted by the pass that writes keys.
const DIGIT_BUFFER: Buf = Buf::INSTANCE_OFFSETS;
/// Bits of depths, and of the tiles of a large image.
const KEY_BITS: [u32; 2] = [DEPTH_BITS, 13];

/// Runs the benchmark.
pub fn run(common: &Common) -> Result<()> {
    let gpu = device::open()?;
    let (counts, rounds): (&[usize], _) = match (common.small, gpu.is_cpu()) {
        (true, _) => (&[2_000, 20_000], 2),
        (false, true) => (&[20_000, 450_000], 10),
        (false, false) => (&[20_000, 450_000, 2_000_000, 10_000_000], 10),
    };
    let own = KernelShape::for_device(gpu.capabilities());
    let lanes =
        KernelShape { sweep_items: 0, digit_bits: KernelShape::new(own.subgroup, gpu.is_cpu()).digit_bits, ..own };
    let sweep = own.with_sweeps(gpu.capabilities());
    let narrow = sweep.filter(|_| gpu.capabilities().has_narrow_storage());
    let forms = [("lanes", Some(lanes)), ("sweep", sweep), ("narrow", narrow)];
    println!("{}: sorts of random keys; positions are the values", gpu.capabilities().name);
    let mut rows = vec![["form", "bits", "items", "ms", "G items/s"].map(str::to_owned).to_vec()];
    let mut found = Vec::new();
    for (name, shape) in forms.into_iter().filter_map(|(name, shape)| Some((name, shape?))) {
        let narrow = name == "narrow";
        let fit = KEY_BITS.into_iter().filter(|&bits| !narrow || bits <= 16);
        for (&count, bits) in counts.iter().flat_map(|count| fit.clone().map(move |bits| (count, bits))) {
            let ms = timed(&gpu, shape, (count, bits, narrow), rounds)?;
            let rate = count as f64 / ms / 1e6;
            let cells =
                [name.to_owned(), bits.to_string(), count.to_string(), format!("{ms:.3}"), format!("{rate:.3}")];
            rows.push(cells.to_vec());
            found.push(json!({ "form": name, "bits": bits, "items": count, "ms": ms }));
        }
    }
    println!("{}", table(&rows));
    let all = json!({ "schema_version": 1, "device": gpu.capabilities().name, "sorts": found });
    write_json(&common.output.join("sort.json"), &all)
}

/// Returns the median ms of a sort of keys with the given bits, either narrow or not. Checks the result.
fn timed(gpu: &Arc<Gpu>, shape: KernelShape, (count, bits, narrow): (usize, u32, bool), rounds: usize) -> Result<f64> {
    let plan = PlanOptions { alias: false, guards: false, barrier_everywhere: true };
    let options = SchedulerOptions { plan, timestamps: true, ..SchedulerOptions::default() };
    let shape = KernelShape { texel: false, ..shape };
    let size = EngineSize::new(u64::from(SWEEP_WORDS), (64, 64));
    let mut engine = Engine::with_shape(Arc::clone(gpu), shape, size, options)?;
    let items = count as u64;
    let sort_lanes = u64::from(shape.lanes(items));
    let sort_cells = sort_lanes << shape.digit_bits;
    engine.set_capacity(Capacity {
        instances: items,
        key_words: items,
        sort_lanes,
        sort_cells,
        sort_totals: sort_cells / u64::from(shape.subgroup),
        look_cells: shape.sweep_cells(items),
        ..*engine.capacity()
    })?;
    let capacity = *engine.capacity();
    let mut builder = Builder::new("sort", &shape, &capacity);
    builder.list.copy(SOURCE_BUFFER, KEY_BUFFERS[0], 0);
    if shape.sweeps() {
        builder.list.fill(Buf::LOOK_BACK, 0).copy(DIGIT_BUFFER, Buf::LOOK_BACK, u64::from(SWEEP_WORDS) * 4);
    }
    let before = builder.list.work.len();
    let buffers = SortBuffers { keys: KEY_BUFFERS, values: VALUE_BUFFERS, narrow };
    let (keys_out, _) = sort(&mut builder, buffers, bits, Count::Instances, "alone", true);
    let list = builder.list;
    let id = engine.raw_mut().prepare(&list)?;
    let mut random = generator(9);
    let mut keys: Vec<u32> = (0..count).map(|_| random.random::<u32>() >> (32 - bits)).collect();
    announce(&mut engine, (bits, &keys), narrow)?;
    let mut times = Vec::new();
    for round in 0..=rounds {
        engine.raw_mut().run(id, 0)?;
        let ns = engine.raw().timings(id, 0)?.iter().skip(before).map(|(_, ns)| *ns as f64).sum::<f64>();
        if ns == 0.0 {
            return Err(Error::NoDevice("this device has no timestamps on its compute queue".to_owned()));
        }
        if round > 0 {
            times.push(ns / 1e6);
        }
    }
    keys.sort_unstable();
    if packed(&keys, narrow) != engine.raw_mut().download::<u32>(keys_out, 0, 0, words(count, narrow))? {
        return Err(Error::Check(format!("{count} keys of {bits} bits are not in order after the sort")));
    }
    Ok(median(times))
}

/// Returns the number of words for the keys.
fn words(count: usize, narrow: bool) -> usize {
    if narrow { count.div_ceil(2) } else { count }
}

/// Packs keys into words; of two 16-bit keys, the first is in the low half.
fn packed(keys: &[u32], narrow: bool) -> Vec<u32> {
    if !narrow {
        return keys.to_vec();
    }
    keys.chunks(2).map(|two| two[0] | two.get(1).map_or(0, |key| key << 16)).collect()
}

/// Uploads the keys, their number, and the counts of the pass that writes keys.
fn announce(engine: &mut Engine, (bits, keys): (u32, &[u32]), narrow: bool) -> Result<()> {
    let (digit_bits, items) = (digit_bits(engine.shape(), bits), engine.shape().sweep_items);
    let mut digits = vec![0_u32; SWEEP_WORDS as usize];
    for pass in 0..bits.div_ceil(digit_bits) {
        for key in keys {
            let digit = key >> (pass * digit_bits) & ((1 << digit_bits) - 1);
            digits[(SWEEP_HISTOGRAMS + pass * SWEEP_DIGITS + digit) as usize] += 1;
        }
    }
    let count = keys.len() as u32;
    let sweeps = engine.shape().sweeps();
    let sched = engine.raw_mut();
    sched.upload(SOURCE_BUFFER, 0, 0, &packed(keys, narrow))?;
    sched.upload(Buf::STEP, 0, 0, &[StepUniforms::zeroed()])?;
    sched.upload(Buf::COUNTERS, 0, 0, &[Counters { instance_count: count, ..Counters::zeroed() }])?;
    if sweeps {
        let partitions = count.div_ceil(SWEEP_LANES * items);
        sched.upload(DIGIT_BUFFER, 0, 0, &digits)?;
        sched.upload(Buf::DISPATCH_ARGS, 0, u64::from(ARGS_SWEEP_INSTANCES), &[partitions, 1, 1])?;
    }
    Ok(())
}
