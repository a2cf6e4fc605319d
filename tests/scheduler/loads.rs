//! The data of steps on a device with memory of its own: through staging, and kept where they come again.

use super::*;
use labelgs::scheduler::DataKey;

const CARD: SchedulerOptions = SchedulerOptions {
    plan: PlanOptions { alias: true, guards: false, barrier_everywhere: false },
    timestamps: false,
    poison_step: false,
    crash_markers: false,
    memory_limit: None,
    as_card: true,
};

/// A scheduler whose memory may grow by so many bytes.
fn limited(gpu: &device::Turn, more: u64) -> Scheduler {
    let need = Scheduler::new(gpu.gpu(), TABLE, pixels(500), CARD).unwrap().memory_total();
    let options = SchedulerOptions { memory_limit: Some(need + more), ..CARD };
    Scheduler::new(gpu.gpu(), TABLE, pixels(500), options).unwrap()
}

fn key(round: u32, item: u32) -> Option<DataKey> {
    Some(DataKey { round, item })
}

/// Copies what came to the host's copy of a report.
fn echo(scheduler: &mut Scheduler) -> labelgs::scheduler::ListId {
    let mut list = PassList::new("echo");
    list.copy(FLOATS, REPORT, 0);
    scheduler.prepare(&list).unwrap()
}

/// Bytes from the host for `loads`, each checked when it is back; four are in flight.
fn sent(scheduler: &mut Scheduler, loads: &[(Option<DataKey>, u32)]) -> u64 {
    let (id, before) = (echo(scheduler), scheduler.traffic().up);
    let data = |seed: u32| (0..500).map(|i| seed * 1000 + i).collect::<Vec<u32>>();
    for step in 0..loads.len() + 4 {
        let frame = step % 4;
        if step >= 4 {
            let back = scheduler.download_all::<u32>(REPORT, frame).unwrap();
            assert_eq!(back, data(loads[step - 4].1), "load {}", step - 4);
        }
        if let Some(&(key, seed)) = loads.get(step) {
            scheduler.load(FLOATS, frame, key, || data(seed).into()).unwrap();
            scheduler.submit(id, frame).unwrap();
        }
    }
    scheduler.traffic().up - before
}

#[test]
fn what_comes_again_comes_from_the_device() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(500), CARD).unwrap();
    assert_eq!(scheduler.frames(), 4);
    let views: Vec<_> = (0..30).map(|i| (key(0, i % 7), i % 7)).collect();
    assert_eq!(sent(&mut scheduler, &views), 7 * 2000);
    assert_eq!(scheduler.kept_bytes(), 7 * 2000);
    // Without a key all come from the host.
    assert_eq!(sent(&mut scheduler, &[(None, 1), (None, 1)]), 2 * 2000);
    // Other counts keep what fits beside them.
    scheduler.set_counts(counts(200, 500)).unwrap();
    assert_eq!(sent(&mut scheduler, &views), 0);
}

#[test]
fn without_room_data_come_from_the_host_and_another_round_makes_room() {
    let Some(gpu) = device() else { return };
    let mut scheduler = limited(&gpu, 8_000);
    // Half of what is left has room for two of three.
    let views: Vec<_> = (0..9).map(|i| (key(0, i % 3), i % 3)).collect();
    assert_eq!(sent(&mut scheduler, &views), 5 * 2000);
    let small: Vec<_> = (0..4).map(|i| (key(1, i % 2), i % 2)).collect();
    assert_eq!(sent(&mut scheduler, &small), 2 * 2000);
    assert_eq!(scheduler.kept_bytes(), 2 * 2000, "those of the round before are gone");
    // More elements need the room.
    scheduler.set_counts(counts(400, 500)).unwrap();
    assert_eq!(scheduler.kept_bytes(), 0);
    assert_eq!(sent(&mut scheduler, &small[..1]), 2000);
}

/// A list that could not be submitted leaves nothing behind that counts as kept.
#[test]
fn data_of_a_list_that_does_not_run_are_not_kept() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(500), CARD).unwrap();
    scheduler.load(FLOATS, 0, key(0, 1), || vec![7_u32; 500].into()).unwrap();
    scheduler.load(FLOATS, 0, key(0, 2), || vec![8_u32; 500].into()).unwrap();
    assert_eq!(scheduler.kept_bytes(), 2000);
    scheduler.set_counts(counts(200, 500)).unwrap();
    assert_eq!(scheduler.kept_bytes(), 0);
    assert_eq!(sent(&mut scheduler, &[(key(0, 1), 3), (key(0, 2), 4), (key(0, 1), 3)]), 2 * 2000);
}

#[test]
fn a_snapshot_keeps_what_lists_change_afterwards() {
    let Some(gpu) = device() else { return };
    let mut scheduler = limited(&gpu, 500);
    let before: Vec<u32> = (0..100).collect();
    scheduler.upload(MODEL, 0, 0, &before).unwrap();
    let snapshot = scheduler.snapshot(&[(MODEL, 90), (PLANES, 0)]).unwrap();
    scheduler.fill(MODEL, 7).unwrap();
    let read = std::thread::spawn(|| snapshot.read()).join().unwrap().unwrap();
    assert_eq!(read, [before[..90].to_vec(), Vec::new()]);
    // Without room for it, the owner reads at once.
    assert!(scheduler.snapshot(&[(MODEL, 100), (PLANES, 400)]).is_err_and(|error| error.is_out_of_memory()));
}

#[test]
fn a_snapshot_may_outlive_its_scheduler() {
    let Some(gpu) = device() else { return };
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, pixels(500), CARD).unwrap();
    let snapshot = scheduler.snapshot(&[(MODEL, 100)]).unwrap();
    let reader = std::thread::spawn(|| {
        std::thread::sleep(std::time::Duration::from_millis(100));
        snapshot.read().unwrap()
    });
    let error = scheduler.set_counts(counts(1 << 40, 500)).unwrap_err();
    assert!(error.is_out_of_memory() && !reader.is_finished(), "what is beyond the limit is refused at once");
    drop(scheduler);
    assert_eq!(reader.join().unwrap()[0].len(), 100, "a snapshot outlives its scheduler");
}

/// Growth frees the planes whose copies are being read, and the reader gets what was there before. The copies are
/// larger than the staging memory, so that the reader is at work while the planes go.
#[test]
fn growth_leaves_a_snapshot_alone() {
    let Some(gpu) = device() else { return };
    let rows = 3 << 20;
    let mut scheduler = Scheduler::new(gpu.gpu(), TABLE, counts(rows, 500), CARD).unwrap();
    let before: Vec<u32> = (0..rows as u32).collect();
    scheduler.upload(MODEL, 0, 0, &before).unwrap();
    scheduler.fill(PLANES, 3).unwrap();
    let snapshot = scheduler.snapshot(&[(MODEL, rows), (PLANES, 4 * rows)]).unwrap();
    let reader = std::thread::spawn(|| snapshot.read().unwrap());
    scheduler.set_counts(counts(rows + 1000, 500)).unwrap();
    scheduler.fill(MODEL, 7).unwrap();
    scheduler.fill(PLANES, 7).unwrap();
    let read = reader.join().unwrap();
    assert!(read[0] == before && read[1].iter().all(|&word| word == 3));
    assert_eq!(read[1].len() as u64, 4 * rows);
}
