//! Random pass lists: with aliasing and with barriers left out, results equal those of one item after another.

use super::*;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

// Each element reads a distant one, so a pass that starts, or scratch that is reused, too early changes results.
toy_shader!(
    shift,
    [("BY", 0, 0), ("COUNT", 1, 0)],
    [("from", R, S, 4), ("other", R, S, 4), ("to", W, S, 4)],
    "layout(local_size_x = 64) in;
    layout(constant_id = 0) const uint BY = 0;
    layout(constant_id = 1) const uint COUNT = 0;
    layout(std430, set=0, binding=0) readonly buffer from_block { uint from[]; };
    layout(std430, set=0, binding=1) readonly buffer other_block { uint other[]; };
    layout(std430, set=0, binding=2) writeonly buffer to_block { uint to[]; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        if (i < COUNT) to[i] = from[(i + BY) % COUNT] * 5 + other[(i + 2 * BY) % COUNT] + 1;
    }"
);

const CASE_COUNT: u32 = 20_000;
const SCRATCH: [Buf; 6] = [A, B, C, D, E, F];

/// A random list, and what `report` must hold after it.
fn random_list(seed: u64) -> (PassList, Vec<u32>) {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut list = PassList::new(format!("random {seed}"));
    let mut values: [Option<Vec<u32>>; 6] = Default::default();
    for _ in 0..random.random_range(8..24) {
        let written = (0..6).filter(|&index| values[index].is_some()).collect::<Vec<_>>();
        let to = random.random_range(0..6);
        let others = written.iter().copied().filter(|&index| index != to).collect::<Vec<_>>();
        if others.is_empty() || random.random_ratio(1, 6) {
            let word = random.random();
            list.fill(SCRATCH[to], word);
            values[to] = Some(vec![word; CASE_COUNT as usize]);
            continue;
        }
        let from = others[random.random_range(0..others.len())];
        let other = others[random.random_range(0..others.len())];
        let (Some(first), Some(second)) = (&values[from], &values[other]) else { continue };
        if random.random_ratio(1, 6) {
            list.copy(SCRATCH[from], SCRATCH[to], 0);
            values[to] = Some(first.clone());
            continue;
        }
        let by = random.random_range(0..CASE_COUNT);
        let at = |values: &[u32], index: u32| values[(index % CASE_COUNT) as usize];
        let result = (0..CASE_COUNT)
            .map(|i| at(first, i + by).wrapping_mul(5).wrapping_add(at(second, i + 2 * by)).wrapping_add(1));
        values[to] = Some(result.collect());
        let buffers = vec![SCRATCH[from], SCRATCH[other], SCRATCH[to]];
        list.pass(
            PassDecl::new(shift(), buffers, Grid::Groups(CASE_COUNT.div_ceil(64), 1, 1)).spec(vec![by, CASE_COUNT]),
        );
    }
    let last = (0..6).rev().find(|&index| values[index].is_some()).unwrap();
    list.copy(SCRATCH[last], REPORT, 0);
    (list, values[last].take().unwrap())
}

#[test]
fn plans_of_all_kinds_give_the_results_of_one_item_after_another() {
    let Some(gpu) = device() else { return };
    let kinds = [(true, false), (false, false), (true, true)];
    for (alias, barrier_everywhere) in kinds {
        let plan = PlanOptions { alias, guards: false, barrier_everywhere };
        let with = SchedulerOptions { poison_step: true, ..options(plan) };
        let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(u64::from(CASE_COUNT)), with).unwrap();
        for seed in 0..12 {
            let (list, expected) = random_list(seed);
            let id = scheduler.prepare(&list).unwrap();
            scheduler.run(id, 0).unwrap();
            let report = scheduler.download_all::<u32>(REPORT, 0).unwrap();
            let wrong = report.iter().zip(&expected).position(|(found, expected)| found != expected);
            assert_eq!(wrong, None, "{plan:?}\n{}", scheduler.plan(id).unwrap().report());
        }
    }
}

#[test]
fn aliasing_saves_memory_and_refuses_to_read_what_is_gone() {
    let Some(gpu) = device() else { return };
    let mut list = PassList::new("chain");
    list.fill(A, 1);
    for pair in [A, B, C, D, E, F].windows(2) {
        list.pass(scaled(pair[0], pair[1], 2, 1, 1000));
    }
    let run = |alias| {
        let plan = PlanOptions { alias, ..PlanOptions::default() };
        let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(1000), options(plan)).unwrap();
        let id = scheduler.prepare(&list).unwrap();
        scheduler.run(id, 0).unwrap();
        let bytes = scheduler.plan(id).unwrap().step_bytes();
        (bytes, scheduler.download_all::<u32>(F, 0).unwrap(), scheduler.download_all::<u32>(A, 0))
    };
    let (shared, shared_f, shared_a) = run(true);
    let (alone, alone_f, alone_a) = run(false);
    assert_eq!((&shared_f, &alone_f), (&vec![63; 1000], &vec![63; 1000]));
    assert!(shared * 3 == alone, "{shared} of {alone} bytes");
    assert_eq!(alone_a.unwrap(), vec![1; 1000]);
    let message = shared_a.expect_err("its bytes were reused").to_string();
    assert!(message.contains("reuses the bytes of a for"), "{message}");
}
