//! Tiles and records of splats that a workgroup shares out, as on a card: the lists of one invocation a splat, and sums
//! of all records.

use super::fixture::Fixture;
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::device::{Turn, options};
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::gpu::{Gpu, GpuOptions};
use labelgs::pass::{KernelShape, render_view};
use labelgs::scheduler::plan::{Buf, Work};
use labelgs::shaders::constants::ORDERED_LANES;
use labelgs::shaders::structs::{Counters, StepUniforms};
use labelgs::verify::selftest::order::DepthOrder;

/// Invocations of a workgroup, and the most records that one of them sums.
pub(super) const WALKERS: u32 = 64;

/// Small and large splats in a picture of more rows of tiles than a workgroup has invocations, if tiles are 8 px high.
pub(super) fn tall_scene() -> Scene {
    let shape = Shape { gaussians: 24, width: 36, height: 530, scales: (0.1, 30.0), sh_degree: 0, ..Shape::default() };
    let mut scene = scene(77, &shape);
    scene.gaussians.scales.iter_mut().step_by(2).for_each(|scale| *scale = [-2.5; 3]);
    scene
}

/// What the passes write that walk splats.
struct Walked {
    touched: Vec<u32>,
    keys: Vec<u32>,
    places: Vec<u32>,
    owners: Vec<u32>,
    rows: usize,
}

fn walk(options: &GpuOptions, group_walks: bool) -> Option<Walked> {
    let turn = Turn::with(Gpu::new(options).ok()?);
    let shape = KernelShape { sweep_items: 0, group_walks, ..KernelShape::for_device(turn.capabilities()) };
    // Keys are counted for sorts that look back, as on a card, and are not.
    let sweeps = group_walks && shape.subgroup > 8;
    let shape = if sweeps { KernelShape { texel: false, ..shape }.with_sweeps_of(4) } else { shape };
    let mut fixture = Fixture::with_shape(turn, tall_scene(), true, shape);
    let counters = fixture.train().counters;
    let (splats, pairs) = (counters.visible_count as usize, counters.instance_count as usize);
    let order = DepthOrder::read(&mut fixture).expect("an order");
    let touched = fixture.get::<u32>(Buf::TILES_TOUCHED, splats);
    let touched: Vec<u32> = order.splats.iter().map(|&splat| touched[splat as usize]).collect();
    gathered(&mut fixture, &order, &touched);
    let (keys, places) = fixture.sorted_pairs(pairs);
    let own = fixture.get::<u32>(Buf::DEPTH_VALUES_A, splats);
    let owners = fixture.get::<u32>(Buf::SPLAT_FROM_INSTANCE, pairs);
    let owners = owners.iter().map(|&splat| own[splat as usize]).collect();
    let rows = fixture.size().1.div_ceil(shape.tile_height as usize);
    Some(Walked { touched, keys, places, owners, rows })
}

/// Sums of hundreds of f32, relative to their magnitudes; 6.3e-7 seen.
const SUM: Tolerance = Tolerance { absolute: 9.4e-7, relative: 0.0 };

/// Compares the sums of the records of each splat, and the statistic, with those in f64, relative to the magnitudes.
fn gathered(fixture: &mut Fixture, order: &DepthOrder, touched: &[u32]) {
    let pairs = touched.iter().sum::<u32>() as usize;
    let records: Vec<[f32; 10]> = {
        let [a, b] = [Buf::V_INSTANCES_A, Buf::V_INSTANCES_B].map(|buf| fixture.get::<[f32; 4]>(buf, pairs));
        let c = fixture.get::<[f32; 2]>(Buf::V_INSTANCES_C, pairs);
        (0..pairs).map(|i| [&a[i][..], &b[i], &c[i]].concat().try_into().expect("ten numbers")).collect()
    };
    let uniforms = fixture.get::<StepUniforms>(Buf::STEP, 1)[0];
    let stats = fixture.get::<[f32; 2]>(Buf::DENSIFY_STATS, fixture.scene.gaussians.len());
    let sums = fixture.get::<[f32; 12]>(Buf::V_SPLATS, touched.len());
    let labels = fixture.model().labels;
    let has_layer = |gaussian: usize| fixture.input.layers.iter().any(|&label| u32::from(label) == labels[gaussian]);
    // `leave_out` leaves the largest record of the splats with many out.
    let compare = |leave_out: bool| {
        let (mut actual, mut expected, mut first) = (Vec::new(), Vec::new(), 0);
        for (rank, &count) in touched.iter().enumerate() {
            let (splat, gaussian) = (order.splats[rank] as usize, order.gaussians[rank] as usize);
            let scene = if has_layer(gaussian) { count / 2 } else { count } as usize;
            let current = |&(_, record): &(usize, &[f32; 10])| record[9].to_bits() == uniforms.stamp;
            let mut own: Vec<_> = records[first..][..count as usize].iter().enumerate().filter(current).collect();
            first += count as usize;
            if leave_out && count > WALKERS {
                let largest = (0..own.len()).max_by(|&a, &b| own[a].1[5].abs().total_cmp(&own[b].1[5].abs()));
                largest.map(|at| own.remove(at));
            }
            let magnitude = |value: usize| own.iter().map(|(_, r)| f64::from(r[value]).abs()).sum::<f64>().max(1e-30);
            for value in 0..9 {
                let sum: f64 = own.iter().map(|(_, r)| f64::from(r[value])).sum();
                actual.push(f64::from(sums[splat][value]) / magnitude(value));
                expected.push(sum / magnitude(value));
            }
            let of_scene = |value: usize, half: u32| {
                own.iter().filter(|(k, _)| *k < scene).map(|(_, r)| f64::from(r[value])).sum::<f64>()
                    * 0.5
                    * f64::from(half)
            };
            let scale = 0.5 * magnitude(0).max(magnitude(1)) * f64::from(uniforms.width.max(uniforms.height));
            if count > 0 {
                actual.push(f64::from(stats[gaussian][0]) / scale);
                expected.push(of_scene(0, uniforms.width).hypot(of_scene(1, uniforms.height)) / scale);
            }
        }
        close(&actual, &expected, SUM)
    };
    let summary = check("sums of records", compare(false));
    println!("sums of records: {:.3} of the tolerance", summary.worst);
    assert!(compare(true).is_err(), "a record may be left out");
}

#[test]
fn a_workgroup_walks_splats_as_invocations_do() {
    let emulated = |size| GpuOptions { subgroup_size: Some(size), emulate_subgroups: true, ..options() };
    for options in [4, 8, 16, 32, 64].map(emulated).into_iter().chain([options()]) {
        let (Some(alone), Some(shared)) = (walk(&options, false), walk(&options, true)) else { return };
        check("tiles of splats", exact(&shared.touched, &alone.touched));
        check("keys", exact(&shared.keys, &alone.keys));
        check("places", exact(&shared.places, &alone.places));
        check("splats", exact(&shared.owners, &alone.owners));
        let large = alone.touched.iter().filter(|&&count| count > WALKERS).count();
        assert!(large > 3 && large + 3 < alone.touched.len(), "{large} of {} are large", alone.touched.len());
        assert!(alone.rows > WALKERS as usize / 2, "{} rows of tiles", alone.rows);
    }
}

/// Lists of splats and pairs over many partitions, where partition `held` tells nothing and invocations of the projection
/// have `items` Gaussians; by a processor without `looks`.
fn listed(scene: Scene, options: &GpuOptions, looks: Option<(Option<u32>, u32)>) -> Option<[Vec<u32>; 5]> {
    let looks_back = looks.is_some();
    let turn = Turn::with(Gpu::new(options).ok()?);
    let shape = KernelShape { sweep_items: 0, group_walks: looks_back, ..KernelShape::for_device(turn.capabilities()) };
    let shape = if looks_back { KernelShape { texel: false, ..shape }.with_sweeps_of(4) } else { shape };
    let mut fixture = Fixture::with_shape(turn, scene, false, shape);
    fixture.render();
    let mut list = render_view(&shape, fixture.engine.capacity(), 0, 0);
    for work in &mut list.work {
        let Work::Pass(pass) = work else { continue };
        for (constant, word) in pass.shader.spec.iter().zip(&mut pass.spec) {
            match (constant.name, looks) {
                ("LOOK_HELD", Some((held, _))) => *word = held.map_or(0, |partition| partition + 1),
                ("VISIBLE_ITEMS", Some((_, items))) => *word = items,
                _ => {}
            }
        }
    }
    let id = fixture.engine.raw_mut().prepare(&list).expect("the list is planned");
    fixture.engine.raw_mut().run(id, 0).expect("run");
    fixture.engine.raw_mut().check_guards().expect("no pass writes outside of its buffers");
    let counters = fixture.get::<Counters>(Buf::COUNTERS, 1)[0];
    assert!(counters.recount_count > 0 || looks.is_none_or(|(held, _)| held.is_none()), "nobody misses a partition");
    let order = DepthOrder::read(&mut fixture).expect("an order");
    let own = fixture.get::<u32>(Buf::DEPTH_VALUES_A, counters.visible_count as usize);
    let (keys, places) = fixture.sorted_pairs(counters.instance_count as usize);
    let owners = fixture.get::<u32>(Buf::SPLAT_FROM_INSTANCE, places.len());
    let owners = places.iter().map(|&place| own[owners[place as usize] as usize]).collect();
    Some([order.gaussians, order.keys, keys, places, owners])
}

#[test]
fn splats_are_listed_and_numbered_wherever_a_partition_is_late() {
    let many = || scene(78, &Shape { gaussians: 3000, scales: (0.1, 1.5), sh_degree: 0, ..Shape::default() });
    let emulated = GpuOptions { subgroup_size: Some(32), emulate_subgroups: true, ..options() };
    for options in [options(), emulated] {
        let Some(expected) = listed(many(), &options, None) else { return };
        let partitions = expected[0].len() / ORDERED_LANES as usize;
        assert!(partitions > 10 && expected[2].len() > 5000, "{partitions} partitions, {} pairs", expected[2].len());
        for looks in [(None, 2), (Some(0), 2), (Some(3), 2), (Some(9), 2), (None, 8), (Some(0), 8), (Some(1), 8)] {
            let found = listed(many(), &options, Some(looks)).expect("a device");
            for (what, (found, expected)) in
                ["Gaussians", "depths", "tiles", "places", "owners"].iter().zip(found.iter().zip(&expected))
            {
                check(what, exact(found, expected));
            }
        }
    }
}
