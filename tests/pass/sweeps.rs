//! Sorts and scans that look back, with subgroups of each size: exact answers, also where a workgroup tells nothing.

use super::orders::{counters, get};
use crate::reference::scan::exclusive_scan;
use crate::reference::sort::radix_sort;
use crate::support::compare::{check, exact};
use crate::support::device::{Turn, device, options};
use crate::support::scenes::generator;
use bytemuck::Zeroable;
use labelgs::engine::growth::capacity;
use labelgs::engine::{Engine, EngineSize, LabelSize};
use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::pass::buffers::Capacity;
use labelgs::pass::build::Count;
use labelgs::pass::scan::Total;
use labelgs::pass::sort::SortBuffers;
use labelgs::pass::{Builder, GroupBlend, KernelShape, Supervision, Variant, render_view, scan, sort, training_step};
use labelgs::scheduler::ListId;
use labelgs::scheduler::plan::{Buf, PassList, Work};
use labelgs::shaders::constants::{
    ARGS_BLEND, ARGS_GAUSSIANS, ARGS_SWEEP_INSTANCES, ARGS_SWEEP_SPLATS, ARGS_TILES, ARGS_WORDS, SWEEP_DIGITS,
    SWEEP_HISTOGRAMS, SWEEP_LANES,
};
use labelgs::shaders::structs::{Counters, StepUniforms};
use rand::Rng;

/// Items of an invocation: small, so that few keys make many partitions.
const ITEMS: u32 = 4;
/// Partitions of the largest case, and a few keys more.
const MOST: usize = 6 * (SWEEP_LANES * ITEMS) as usize + 77;
/// Numbers of items around the borders of partitions.
const COUNTS: [usize; 6] = [0, 1, 1023, 1024, 1025, MOST];

/// Buffers of narrow keys.
const TILES: SortBuffers = SortBuffers {
    keys: [Buf::TILE_KEYS_A, Buf::TILE_KEYS_B],
    values: [Buf::TILE_VALUES_A, Buf::TILE_VALUES_B],
    narrow: true,
};

/// Opens a device with subgroups of each size, through shared memory, and calls `test` with its engine.
fn each_size(items: usize, mut test: impl FnMut(&mut Engine)) {
    for size in [4, 8, 16, 32, 64] {
        let chosen = GpuOptions { subgroup_size: Some(size), emulate_subgroups: true, ..options() };
        let Ok(gpu) = Gpu::new(&chosen) else { return };
        let turn = Turn::with(gpu);
        test(&mut engine(&turn, items));
    }
    // And the device's own, with its own ballots.
    if let Ok(gpu) = Gpu::new(&options()) {
        let turn = Turn::with(gpu);
        test(&mut engine(&turn, items));
    }
}

fn engine(turn: &Turn, items: usize) -> Engine {
    let shape = KernelShape { texel: false, ..KernelShape::for_device(turn.capabilities()) }.with_sweeps_of(ITEMS);
    let size = EngineSize::new(items as u64, (64, 64));
    Engine::with_shape(turn.gpu(), shape, size, super::fixture::readable()).expect("the engine starts")
}

/// Records the passes that `declare` adds; partition `held` tells nothing.
fn list(engine: &mut Engine, held: Option<u32>, declare: impl FnOnce(&mut Builder)) -> ListId {
    let (shape, capacity) = (*engine.shape(), *engine.capacity());
    let mut builder = Builder::new("test", &shape, &capacity);
    declare(&mut builder);
    let mut list: PassList = builder.list;
    for work in &mut list.work {
        let Work::Pass(pass) = work else { continue };
        let place = pass.shader.spec.iter().position(|constant| constant.name == "LOOK_HELD").expect("all are sweeps");
        pass.spec[place] = held.map_or(0, |partition| partition + 1);
    }
    engine.raw_mut().prepare(&list).expect("the list is planned")
}

/// Sets numbers of items and partitions, and what the pass that wrote the keys has counted of them.
fn announce(engine: &mut Engine, count: usize, (bits, keys): (u32, &[u32])) {
    let cells = engine.capacity().look_cells as usize;
    let digit_bits = sort::digit_bits(engine.shape(), bits);
    let mut sweep = vec![0_u32; cells];
    for pass in 0..bits.div_ceil(digit_bits) {
        for key in keys {
            let digit = key >> (pass * digit_bits) & ((1 << digit_bits) - 1);
            sweep[(SWEEP_HISTOGRAMS + pass * SWEEP_DIGITS + digit) as usize] += 1;
        }
    }
    let count = count as u32;
    let (sorting, scanning) = (count.div_ceil(SWEEP_LANES * engine.shape().sweep_items), count.div_ceil(64));
    let mut args = [0_u32; ARGS_WORDS as usize];
    for (ats, groups) in
        [([ARGS_SWEEP_SPLATS, ARGS_SWEEP_INSTANCES], sorting), ([ARGS_GAUSSIANS, ARGS_TILES], scanning)]
    {
        ats.iter().for_each(|&at| args[at as usize..][..3].copy_from_slice(&[groups, 1, 1]));
    }
    let (tile_count, most) = (count, u32::MAX);
    let uniforms = StepUniforms {
        gaussian_count: count,
        tile_count,
        layer_tile_capacity: most,
        longest_list: most,
        ..StepUniforms::zeroed()
    };
    let counters = Counters { visible_count: count, instance_count: count, ..Counters::zeroed() };
    let sched = engine.raw_mut();
    sched.upload(Buf::LOOK_BACK, 0, 0, &sweep).expect("upload");
    sched.upload(Buf::DISPATCH_ARGS, 0, 0, &args).expect("upload");
    sched.upload(Buf::STEP, 0, 0, &[uniforms]).expect("upload");
    sched.upload(Buf::COUNTERS, 0, 0, &[counters]).expect("upload");
}

fn run(engine: &mut Engine, id: ListId) {
    engine.raw_mut().run(id, 0).expect("run");
    engine.raw_mut().check_guards().expect("no pass writes outside of its buffers");
}

#[test]
fn a_scan_is_exact_and_saturates() {
    each_size(MOST, |engine| {
        for held in [None, Some(0), Some(3)] {
            let id = list(engine, held, |b| {
                scan::scan(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS, Count::Gaussians, Total::Densified);
            });
            let mut random = generator(71);
            for most in [900, u32::MAX / 1000] {
                for count in COUNTS {
                    let values: Vec<u32> = (0..count).map(|_| random.random_range(0..most)).collect();
                    announce(engine, count, (0, &[]));
                    engine.raw_mut().upload(Buf::TILES_TOUCHED, 0, 0, &values).expect("upload");
                    run(engine, id);
                    let (mut offsets, mut total) = exclusive_scan(&values);
                    // A word of a partition has 30 bits of the sum.
                    const SUM_MAX: u32 = (1 << 30) - 1;
                    offsets.iter_mut().for_each(|offset| *offset = (*offset).min(SUM_MAX));
                    total = if total >= SUM_MAX { u32::MAX } else { total };
                    check("offsets", exact(&get(engine, Buf::INSTANCE_OFFSETS, count), &offsets));
                    assert_eq!(counters(engine).densified_count, total, "{count} items");
                }
            }
        }
    });
}

#[test]
fn occupied_tiles_are_listed_and_counted() {
    each_size(MOST, |engine| {
        let room = Capacity { virtual_tiles: MOST as u64, ..*engine.capacity() };
        engine.set_capacity(room).expect("room");
        let id = list(engine, Some(1), |b| scan::list(b, Buf::TILES_TOUCHED, Buf::INSTANCE_OFFSETS));
        let mut random = generator(73);
        for count in COUNTS {
            let occupied: Vec<u32> = (0..count).map(|_| u32::from(random.random_bool(0.3))).collect();
            announce(engine, count, (0, &[]));
            engine.raw_mut().upload(Buf::TILES_TOUCHED, 0, 0, &occupied).expect("upload");
            run(engine, id);
            let expected: Vec<u32> = (0..count as u32).filter(|&i| occupied[i as usize] != 0).collect();
            check("tiles", exact(&get(engine, Buf::INSTANCE_OFFSETS, expected.len()), &expected));
            assert_eq!(counters(engine).layer_tile_count as usize, expected.len(), "{count} tiles");
            let groups = if count == 0 { 0 } else { count + expected.len() };
            assert_eq!(get(engine, Buf::DISPATCH_ARGS, ARGS_BLEND as usize + 1)[ARGS_BLEND as usize], groups as u32);
        }
    });
}

/// Keys of all 32 bits, few different ones (equal ones must keep their order), one, ascending ones.
#[test]
fn a_sort_is_exact_and_stable() {
    each_size(MOST, |engine| {
        for held in [None, Some(0), Some(5)] {
            let cases = [(MOST, u32::MAX), (MOST, 3), (MOST, 1), (1025, 300), (1, 9), (0, 1)];
            sort_exactly(engine, held, false, &cases);
        }
    });
}

/// Keys of 16 bits, in buffers that end with the last one: all of them, odd numbers, few different ones, the largest
/// alone.
#[test]
fn a_sort_of_narrow_keys_is_exact_and_stable() {
    if !device().is_some_and(|turn| turn.capabilities().has_narrow_storage()) {
        return;
    }
    each_size(MOST, |engine| {
        let room = Capacity { instances: MOST as u64, key_words: MOST.div_ceil(2) as u64, ..*engine.capacity() };
        engine.set_capacity(room).expect("room");
        for held in [None, Some(0), Some(5)] {
            let cases = [(MOST, 1 << 16), (MOST, 3), (MOST - 1, 1), (1025, 300), (1, 9), (1, 1), (0, 1)];
            sort_exactly(engine, held, true, &cases);
        }
    });
}

#[test]
fn keys_are_narrow_where_16_bits_number_all_tiles() {
    let card = KernelShape { narrow_keys: true, ..KernelShape::new(32, false) };
    let sweeps = card.with_sweeps_of(16);
    assert!([1, 65_535, 65_536].iter().all(|&tiles| sweeps.has_narrow_keys(tiles)));
    assert!(!sweeps.has_narrow_keys(65_537) && !card.has_narrow_keys(1));
    assert!(!KernelShape { narrow_keys: false, ..sweeps }.has_narrow_keys(1));
    // 16 x 8 px each.
    for (height, narrow) in [(2048, true), (2056, false)] {
        let capacity = capacity(&sweeps, &EngineSize::new(999_999, (4096, height)));
        assert_eq!((capacity.virtual_tiles <= 65_536, capacity.instances), (narrow, 5_999_994), "{height}");
        assert_eq!(capacity.key_words, if narrow { 2_999_997 } else { 5_999_994 }, "{height}");
    }
}

/// Lists without object layers are sorted by the tiles of the scene, however many layers others have.
#[test]
fn lists_without_layers_sort_fewer_digits() {
    let shape = KernelShape { narrow_keys: true, ..KernelShape::new(32, false) }.with_sweeps_of(16);
    let shape = shape.with_group_blend_of(GroupBlend::DEFAULT);
    let labels = Some(LabelSize { max_label: 40, layers: 10, vote_columns: 9 });
    let capacity = capacity(&shape, &EngineSize::new(1000, (1600, 1064)).for_training().with_labels(labels));
    assert_eq!((capacity.tiles(), capacity.virtual_tiles), (6700, 73_700));
    let step = |supervision| {
        let variant = Variant { supervision, ..Variant::plain((1600, 1064)) };
        training_step(&shape, &capacity, variant)
    };
    let sorts = |list: PassList| -> Vec<&str> {
        let by_tile = list.work.iter().filter_map(|work| match work {
            Work::Pass(pass) if pass.title.ends_with(" by tile") => Some(pass.shader.name),
            _ => None,
        });
        by_tile.collect()
    };
    assert_eq!(sorts(step(Supervision::Layers { lift: false })), ["radix_sweep"; 3]);
    assert_eq!(sorts(step(Supervision::Disagreement)), ["radix_sweep_narrow"; 2]);
    assert_eq!(sorts(render_view(&shape, &capacity, 3, 1)), ["radix_sweep_narrow"; 2]);
}

fn put_keys(engine: &mut Engine, buffer: Buf, keys: &[u32], narrow: bool) {
    if !narrow {
        return engine.raw_mut().upload(buffer, 0, 0, keys).expect("upload");
    }
    let mut halves: Vec<u16> = keys.iter().map(|&key| u16::try_from(key).expect("16 bits")).collect();
    halves.resize(halves.len().next_multiple_of(2), 0x5a5a);
    engine.raw_mut().upload(buffer, 0, 0, &halves).expect("upload");
}

fn get_keys(engine: &mut Engine, buffer: Buf, count: usize, narrow: bool) -> Vec<u32> {
    if !narrow {
        return get(engine, buffer, count);
    }
    let halves = engine.raw_mut().download::<u16>(buffer, 0, 0, count.next_multiple_of(2)).expect("download");
    halves.into_iter().take(count).map(u32::from).collect()
}

/// Sorts keys and compares. Cases are (number of keys, number of distinct keys); the first one is sorted in ascending
/// order too. Narrow keys are the largest ones.
fn sort_exactly(engine: &mut Engine, held: Option<u32>, narrow: bool, cases: &[(usize, u32)]) {
    let depths = SortBuffers {
        keys: [Buf::DEPTH_KEYS_A, Buf::DEPTH_KEYS_B],
        values: [Buf::DEPTH_VALUES_A, Buf::DEPTH_VALUES_B],
        narrow,
    };
    let (buffers, bits, count) = if narrow { (TILES, 16, Count::Instances) } else { (depths, 32, Count::Splats) };
    let mut found = None;
    let id = list(engine, held, |b| found = Some(sort::sort(b, buffers, bits, count, "by key", false)));
    let (keys_out, values_out) = found.expect("the sort was declared");
    let mut random = generator(73);
    for (case, &(count, different)) in cases.iter().enumerate() {
        let mut keys: Vec<u32> = (0..count).map(|_| random.random_range(0..different)).collect();
        if narrow {
            keys.iter_mut().for_each(|key| *key = u32::from(u16::MAX) - *key);
        }
        if case == 0 {
            keys.sort_unstable();
        }
        let values: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
        announce(engine, count, (bits, &keys));
        put_keys(engine, buffers.keys[0], &keys, narrow);
        engine.raw_mut().upload(buffers.values[0], 0, 0, &values).expect("upload");
        run(engine, id);
        let order = radix_sort(&keys);
        let by_order = |of: &[u32]| order.iter().map(|&place| of[place]).collect::<Vec<_>>();
        check("keys", exact(&get_keys(engine, keys_out, count, narrow), &by_order(&keys)));
        let found = get(engine, values_out, count);
        check("values", exact(&found, &by_order(&values)));
        // A sort that turns equal keys around is seen.
        if different < 100 && count > 1000 {
            let mut turned: Vec<usize> = (0..count).rev().collect();
            turned.sort_by_key(|&place| keys[place]);
            let turned: Vec<u32> = turned.iter().map(|&place| values[place]).collect();
            assert!(exact(&found, &turned).is_err());
        }
    }
}

/// As many keys as a large scene has pairs, in partitions of the size that cards have.
#[test]
fn ten_million_keys_are_sorted() {
    const KEYS: usize = 10_000_000;
    let Ok(gpu) = Gpu::new(&options()) else { return };
    let turn = Turn::with(gpu);
    let shape = KernelShape { texel: false, ..KernelShape::for_device(turn.capabilities()) }.with_sweeps_of(8);
    let size = EngineSize::new(1, (64, 64));
    let mut engine =
        Engine::with_shape(turn.gpu(), shape, size, super::fixture::readable()).expect("the engine starts");
    let keys = KEYS as u64;
    let room = Capacity { instances: keys, key_words: keys, look_cells: shape.sweep_cells(keys), ..*engine.capacity() };
    engine.set_capacity(room).expect("room");
    let buffers = SortBuffers { narrow: false, ..TILES };
    let mut found = None;
    let id = list(&mut engine, None, |b| found = Some(sort::sort(b, buffers, 13, Count::Instances, "by tile", true)));
    let (keys_out, values_out) = found.expect("the sort was declared");
    let mut random = generator(75);
    let keys: Vec<u32> = (0..KEYS).map(|_| random.random_range(0..1 << 13)).collect();
    announce(&mut engine, KEYS, (13, &keys));
    engine.raw_mut().upload(buffers.keys[0], 0, 0, &keys).expect("upload");
    run(&mut engine, id);
    let order = radix_sort(&keys);
    let places: Vec<u32> = order.iter().map(|&place| place as u32).collect();
    let sorted: Vec<u32> = order.iter().map(|&place| keys[place]).collect();
    check("keys", exact(&get(&mut engine, keys_out, KEYS), &sorted));
    check("places", exact(&get(&mut engine, values_out, KEYS), &places));
}
