//! Memory: prediction, guards, poison, capacities.

use super::*;
use labelgs::Error;
use labelgs::cli::support::exit_status::exit_status;
use labelgs::scheduler::plan::MemoryReport;

toy_shader!(
    overrun,
    [("INDEX", 0, 0)],
    [("to", W, S, 4)],
    "layout(local_size_x = 1) in;
    layout(constant_id = 0) const uint INDEX = 0;
    layout(std430, set=0, binding=0) writeonly buffer to_block { uint to[]; };
    void main() { to[INDEX] = 7; }"
);

fn ramp(count: u32) -> Vec<u32> {
    (0..count).map(|i| i * i + 1).collect()
}

#[test]
fn allocated_memory_equals_the_prediction() {
    let Some(gpu) = device() else { return };
    let mut list = PassList::new("toy");
    list.fill(A, 5).pass(scaled(A, B, 3, 1, 5000)).copy(B, REPORT, 0);
    let (limits, capacity) = (gpu.limits().plan, pixels(5000));
    let predicted =
        MemoryReport::predict(TABLE, &capacity, std::slice::from_ref(&list), &limits, PlanOptions::default()).unwrap();
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, capacity, SchedulerOptions::default()).unwrap();
    scheduler.prepare(&list).unwrap();
    assert_eq!(scheduler.memory_total(), predicted.total, "{}", predicted.report());
    let report = scheduler.memory().into_iter().find(|(name, _)| name == "report");
    assert_eq!(report.map(|(_, bytes)| bytes), Some(2 * 20_032), "two copies, in multiples of 64");
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_allocated() {
    let Some(gpu) = device() else { return };
    let too_large = counts(1 << 40, 64);
    let error = Scheduler::new(gpu.gpu(), TABLE, too_large.clone(), SchedulerOptions::default()).unwrap_err();
    assert!(matches!(error, Error::OutOfMemory { .. }), "{error}");
    assert_eq!(exit_status(&error), 5);
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(64), SchedulerOptions::default()).unwrap();
    scheduler.upload(MODEL, 0, 0, &ramp(100)).unwrap();
    assert!(scheduler.set_counts(too_large).is_err());
    assert_eq!(scheduler.counts(), &pixels(64), "the old capacities stay in force");
    assert_eq!(scheduler.download_all::<u32>(MODEL, 0).unwrap(), ramp(100));
}

#[test]
fn a_new_capacity_keeps_the_model() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(64), SchedulerOptions::default()).unwrap();
    assert_eq!(scheduler.download_all::<u32>(MODEL, 0).unwrap(), vec![0; 100], "fresh memory is zero");
    scheduler.upload(MODEL, 0, 0, &ramp(100)).unwrap();
    scheduler.upload(PLANES, 0, 99, &[[1.0_f32, 2.0, 3.0, 4.0]]).unwrap();
    scheduler.fill(TOTALS, 9).unwrap();
    scheduler.set_counts(counts(250, 64)).unwrap();
    let grown = scheduler.download_all::<u32>(MODEL, 0).unwrap();
    assert_eq!((&grown[..100], &grown[100..]), (&ramp(100)[..], &vec![0; 150][..]));
    let planes = scheduler.download::<[f32; 4]>(PLANES, 0, 98, 3).unwrap();
    assert_eq!(planes, [[0.0; 4], [1.0, 2.0, 3.0, 4.0], [0.0; 4]]);
    assert_eq!(scheduler.download_all::<u32>(TOTALS, 0).unwrap(), vec![0; 16], "kept buffers start afresh");
    scheduler.set_counts(counts(30, 64)).unwrap();
    assert_eq!(scheduler.download_all::<u32>(MODEL, 0).unwrap(), ramp(30));
    scheduler.set_counts(counts(0, 0)).unwrap();
    scheduler.set_counts(pixels(64)).unwrap();
    let mut list = PassList::new("after");
    list.fill(A, 5).pass(scaled(A, B, 3, 1, 64)).copy(B, REPORT, 0);
    let id = scheduler.prepare(&list).unwrap();
    scheduler.run(id, 0).unwrap();
    assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), vec![16; 64]);
}

#[test]
fn a_larger_list_leaves_earlier_ones_usable() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(3000), SchedulerOptions::default()).unwrap();
    let mut small = PassList::new("small");
    small.fill(A, 4).copy(A, REPORT, 0);
    let mut large = PassList::new("large");
    large.fill(A, 1).fill(B, 2).fill(C, 3).pass(scaled(A, D, 2, 0, 3000));
    large.pass(scaled(B, E, 2, 0, 3000)).pass(scaled(C, F, 2, 0, 3000)).copy(F, REPORT, 0);
    let first = scheduler.prepare(&small).unwrap();
    scheduler.submit(first, 0).unwrap();
    let second = scheduler.prepare(&large).unwrap();
    for _ in 0..3 {
        scheduler.run(first, 0).unwrap();
        assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), vec![4; 3000]);
        scheduler.run(second, 0).unwrap();
        assert_eq!(scheduler.download_all::<u32>(REPORT, 0).unwrap(), vec![6; 3000]);
    }
}

#[test]
fn guards_detect_a_write_beyond_the_end() {
    let Some(gpu) = device() else { return };
    let guarded = options(PlanOptions { guards: true, ..PlanOptions::default() });
    for (buf, name, count) in [(B, "b", 1000), (MODEL, "model", 100), (REPORT, "report", 1000)] {
        let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(1000), guarded).unwrap();
        scheduler.check_guards().unwrap();
        let write = |index: u32| {
            let mut list = PassList::new("write");
            list.fill(A, 1).fill(C, 2);
            list.pass(PassDecl::new(overrun(), vec![buf], Grid::Groups(1, 1, 1)).spec(vec![index]));
            list
        };
        let inside = scheduler.prepare(&write(count - 1)).unwrap();
        scheduler.run(inside, 1).unwrap();
        scheduler.check_guards().unwrap();
        let outside = scheduler.prepare(&write(count + 3)).unwrap();
        scheduler.run(outside, 1).unwrap();
        let message = scheduler.check_guards().expect_err("the guard is broken").to_string();
        let expected = format!("0x00000007 at byte 12 past the end of buffer {name}");
        assert!(message.contains(&expected), "{message}");
    }
}

#[test]
fn scratch_can_be_uploaded_without_aliasing_and_is_poisoned_when_asked() {
    let Some(gpu) = device() else { return };
    let alone = PlanOptions { alias: false, ..PlanOptions::default() };
    let with = SchedulerOptions { poison_step: true, ..options(alone) };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(500), with).unwrap();
    let mut list = PassList::new("toy");
    list.pass(scaled(A, B, 2, 0, 500)).fill(C, 0);
    let id = scheduler.prepare(&list).unwrap();
    let found = scheduler.download_all::<f32>(A, 0).unwrap();
    assert!(found.iter().all(|value| value.is_nan()), "fresh scratch is NaN");
    scheduler.upload(A, 0, 0, &ramp(500)).unwrap();
    scheduler.run(id, 0).unwrap();
    let doubled = ramp(500).iter().map(|value| value * 2).collect::<Vec<_>>();
    assert_eq!(scheduler.download_all::<u32>(B, 0).unwrap(), doubled);
    assert_eq!(scheduler.download::<u32>(B, 0, 3, 2).unwrap(), doubled[3..5]);
}

#[test]
fn transfers_larger_than_the_staging_memory_are_exact() {
    let Some(gpu) = device() else { return };
    let count = 5_000_001_u32;
    let capacity = counts(u64::from(count), 64);
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, capacity, SchedulerOptions::default()).unwrap();
    let values = (0..count).map(|i| i.wrapping_mul(2_654_435_761)).collect::<Vec<_>>();
    scheduler.upload(MODEL, 0, 0, &values).unwrap();
    assert!(scheduler.download_all::<u32>(MODEL, 0).unwrap() == values);
}
