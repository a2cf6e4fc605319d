//! Scan and sort by lanes, as on CPUs, on numbers of every kind: exact answers. `sweeps` tests those of GPUs.

use super::fixture::readable;
use crate::reference::scan::exclusive_scan;
use crate::reference::sort::radix_sort;
use crate::support::compare::{check, exact};
use crate::support::device;
use crate::support::scenes::generator;
use bytemuck::Zeroable;
use labelgs::engine::{Engine, EngineSize};
use labelgs::pass::buffers::Capacity;
use labelgs::pass::build::Count;
use labelgs::pass::scan::Total;
use labelgs::pass::sort::SortBuffers;
use labelgs::pass::{Builder, KernelShape, scan, sort};
use labelgs::scheduler::ListId;
use labelgs::scheduler::plan::Buf;
use labelgs::shaders::constants::KEY_INVISIBLE;
use labelgs::shaders::structs::{Counters, StepUniforms};
use rand::Rng;

const ITEM_COUNT_MAX: usize = 5000;

fn engine(gpu: std::sync::Arc<labelgs::gpu::Gpu>) -> Engine {
    let room = EngineSize::new(ITEM_COUNT_MAX as u64, (64, 64));
    let (subgroup, is_cpu) = (&gpu.capabilities().subgroup, gpu.is_cpu());
    let shape = KernelShape { emulated: subgroup.is_emulated, ..KernelShape::new(subgroup.size, is_cpu) };
    Engine::with_shape(gpu, shape, room, readable()).expect("the engine starts")
}

/// Records the passes that `declare` adds.
fn list(engine: &mut Engine, declare: impl FnOnce(&mut Builder)) -> ListId {
    let (shape, capacity): (KernelShape, Capacity) = (*engine.shape(), *engine.capacity());
    let mut builder = Builder::new("test", &shape, &capacity);
    declare(&mut builder);
    let list = builder.list;
    engine.raw_mut().prepare(&list).expect("the list is planned")
}

/// Sets the numbers of Gaussians, splats and pairs to `count`.
fn announce(engine: &mut Engine, count: usize) {
    let count = count as u32;
    let uniforms = StepUniforms { gaussian_count: count, ..StepUniforms::zeroed() };
    let counters = Counters { visible_count: count, instance_count: count, ..Counters::zeroed() };
    engine.raw_mut().upload(Buf::STEP, 0, 0, &[uniforms]).expect("upload");
    engine.raw_mut().upload(Buf::COUNTERS, 0, 0, &[counters]).expect("upload");
}

pub fn get(engine: &mut Engine, buf: Buf, count: usize) -> Vec<u32> {
    engine.raw_mut().download(buf, 0, 0, count).expect("download")
}

pub fn counters(engine: &mut Engine) -> Counters {
    engine.raw_mut().download::<Counters>(Buf::COUNTERS, 0, 0, 1).expect("download")[0]
}

const ITEM_COUNTS: [usize; 7] = [0, 1, 7, 63, 64, 1000, ITEM_COUNT_MAX];

#[test]
fn scan_is_exact_and_saturates() {
    let Some(turn) = device() else { return };
    let mut engine = engine(turn.gpu());
    let id = list(&mut engine, |b| {
        scan::scan(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS, Count::Splats, Total::Densified)
    });
    let mut random = generator(71);
    for count in ITEM_COUNTS {
        // More than 2^32 in all, with the longest list.
        let most = if count == ITEM_COUNT_MAX { u32::MAX / 1000 } else { 900 };
        let values: Vec<u32> = (0..count).map(|_| random.random_range(0..most)).collect();
        announce(&mut engine, count);
        engine.raw_mut().upload(Buf::TILES_TOUCHED, 0, 0, &values).expect("upload");
        engine.raw_mut().run(id, 0).expect("run");
        engine.raw_mut().check_guards().expect("no pass writes outside of its buffers");
        let (offsets, total) = exclusive_scan(&values);
        check("offsets", exact(&get(&mut engine, Buf::INSTANCE_OFFSETS, count), &offsets));
        assert_eq!(counters(&mut engine).densified_count, total);
        assert_eq!(total == u32::MAX, count == ITEM_COUNT_MAX);
    }
}

#[test]
fn scan_of_visible_keys_is_exact() {
    let Some(turn) = device() else { return };
    let mut engine = engine(turn.gpu());
    let id = list(&mut engine, |b| scan::scan_visible(b, Buf::DEPTH_KEYS, Buf::VISIBLE_OFFSETS));
    let mut random = generator(72);
    for count in ITEM_COUNTS {
        let key = |random: &mut rand_pcg::Pcg32| if random.random_bool(0.4) { KEY_INVISIBLE } else { random.random() };
        let keys: Vec<u32> = (0..count).map(|_| key(&mut random)).collect();
        announce(&mut engine, count);
        engine.raw_mut().upload(Buf::DEPTH_KEYS, 0, 0, &keys).expect("upload");
        engine.raw_mut().run(id, 0).expect("run");
        let flags: Vec<u32> = keys.iter().map(|&key| u32::from(key != KEY_INVISIBLE)).collect();
        let (offsets, total) = exclusive_scan(&flags);
        check("offsets", exact(&get(&mut engine, Buf::VISIBLE_OFFSETS, count), &offsets));
        assert_eq!(counters(&mut engine).visible_count, total);
    }
}

/// All 32 bits, few different keys (equal ones must keep their order), and one key.
#[test]
fn sort_of_keys_and_values_is_exact_and_stable() {
    let Some(turn) = device() else { return };
    let cases =
        [(ITEM_COUNT_MAX, u32::MAX), (ITEM_COUNT_MAX, 3), (ITEM_COUNT_MAX, 1), (1000, 300), (9, 4), (1, 9), (0, 1)];
    sort_exactly(&mut engine(turn.gpu()), &cases);
}

/// Sorts keys and compares. Cases are (number of keys, number of distinct keys).
fn sort_exactly(engine: &mut Engine, cases: &[(usize, u32)]) {
    let buffers = SortBuffers {
        keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
        values: [Buf::DEPTH_VALUES_A, Buf::DEPTH_VALUES_B],
        narrow: false,
    };
    let mut found = None;
    let id = list(engine, |b| found = Some(sort::sort(b, buffers, 32, Count::Splats, "by depth", false)));
    let (keys_out, values_out) = found.expect("the sort was declared");
    let mut random = generator(73);
    for &(count, different) in cases {
        let keys: Vec<u32> = (0..count).map(|_| random.random_range(0..different)).collect();
        let values: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
        announce(engine, count);
        engine.raw_mut().upload(buffers.keys[0], 0, 0, &keys).expect("upload");
        engine.raw_mut().upload(buffers.values[0], 0, 0, &values).expect("upload");
        engine.raw_mut().run(id, 0).expect("run");
        engine.raw_mut().check_guards().expect("no pass writes outside of its buffers");
        let order = radix_sort(&keys);
        let by_order = |of: &[u32]| order.iter().map(|&place| of[place]).collect::<Vec<_>>();
        check("keys", exact(&get(engine, keys_out, count), &by_order(&keys)));
        check("values", exact(&get(engine, values_out, count), &by_order(&values)));
    }
}

/// As many lanes as 33 million pairs have: the scan of their histogram stays below lavapipe's 65,535 rounds.
#[test]
fn sort_with_the_lanes_of_a_large_scene_is_exact() {
    let Some(turn) = device() else { return };
    let mut engine = engine(turn.gpu());
    let (subgroup, digit_bits) = (u64::from(engine.shape().subgroup), engine.shape().digit_bits);
    let lanes = 140 * subgroup;
    let large = Capacity {
        sort_lanes: lanes,
        sort_cells: lanes << digit_bits,
        sort_totals: 140 << digit_bits,
        ..*engine.capacity()
    };
    engine.set_capacity(large).expect("room");
    sort_exactly(&mut engine, &[(ITEM_COUNT_MAX, u32::MAX), (ITEM_COUNT_MAX, 3)]);
}

/// From one pass of the sort to all that 32 bits take; the values are the places before the sort.
#[test]
fn sort_by_some_bits_is_exact() {
    let Some(turn) = device() else { return };
    let mut engine = engine(turn.gpu());
    let mut random = generator(74);
    for bits in [1, 7, 8, 9, 16, 17, 30] {
        let buffers = SortBuffers {
            keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
            values: [Buf::DEPTH_VALUES_A, Buf::DEPTH_VALUES_B],
            narrow: false,
        };
        let mut found = None;
        let id = list(&mut engine, |b| found = Some(sort::sort(b, buffers, bits, Count::Splats, "by tile", true)));
        let (keys_out, values_out) = found.expect("the sort was declared");
        let keys: Vec<u32> = (0..ITEM_COUNT_MAX).map(|_| random.random_range(0..1 << bits)).collect();
        announce(&mut engine, ITEM_COUNT_MAX);
        engine.raw_mut().upload(buffers.keys[0], 0, 0, &keys).expect("upload");
        engine.raw_mut().run(id, 0).expect("run");
        let order = radix_sort(&keys);
        let sorted: Vec<u32> = order.iter().map(|&place| keys[place]).collect();
        let places: Vec<u32> = order.iter().map(|&place| place as u32).collect();
        check("keys", exact(&get(&mut engine, keys_out, ITEM_COUNT_MAX), &sorted));
        check("places", exact(&get(&mut engine, values_out, ITEM_COUNT_MAX), &places));
    }
}
