//! Every injected failure of Vulkan ends in an error, never in a crash or a hang.

use super::*;
use labelgs::cli::support::exit_status::exit_status;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

const CHILD_VARIABLE: &str = "LABELGS_FAULT_CHILD";

/// How long the snapshot of a growth has no reader; a growth that does not wait for it takes milliseconds.
const UNREAD_TIME: Duration = Duration::from_millis(500);

/// Uses all parts of the scheduler. It is a test so that the other tests can run it in a child process.
#[test]
fn child() {
    let Some(kind) = std::env::var_os(CHILD_VARIABLE) else { return };
    match if kind == "grow" { growth() } else { work().map(|()| "done") } {
        Ok(outcome) => println!("outcome: {outcome}"),
        Err(error) => println!("outcome: {} {error}", exit_status(&error)),
    }
}

fn work() -> labelgs::Result<()> {
    let gpu = labelgs::gpu::Gpu::new(&labelgs::gpu::GpuOptions::from_env()?)?;
    let with = SchedulerOptions { timestamps: true, crash_markers: true, ..SchedulerOptions::default() };
    let mut scheduler = Scheduler::new(gpu, TABLE, pixels(256), with)?;
    let mut list = PassList::new("toy");
    list.fill(A, 5).pass(scaled(A, B, 3, 1, 256).label("three times")).copy(B, REPORT, 0);
    let id = scheduler.prepare(&list)?;
    scheduler.run(id, 0)?;
    let ramp = (0..100).collect::<Vec<u32>>();
    scheduler.upload(MODEL, 0, 0, &ramp)?;
    if let Err(error) = scheduler.set_counts(counts(200, 512)) {
        if exit_status(&error) == 5 {
            // The model is unchanged and the old capacities still work.
            assert_eq!(scheduler.counts(), &pixels(256));
            assert_eq!(scheduler.download_all::<u32>(MODEL, 0)?, ramp);
            let id = scheduler.prepare(&list)?;
            scheduler.run(id, 0)?;
            assert_eq!(scheduler.download_all::<u32>(REPORT, 0)?, vec![16; 256]);
        }
        return Err(error);
    }
    assert_eq!(scheduler.download::<u32>(MODEL, 0, 0, 100)?, ramp);
    let id = scheduler.prepare(&list)?;
    for step in 0..4 {
        scheduler.submit(id, step % 2)?;
    }
    scheduler.wait_all()?;
    scheduler.timings(id, 0)?;
    scheduler.download_all::<u32>(REPORT, 0).map(|_| ())
}

/// Grows the model while a snapshot of it has not been read. Both have the contents from before.
fn growth() -> labelgs::Result<&'static str> {
    let gpu = labelgs::gpu::Gpu::new(&labelgs::gpu::GpuOptions::from_env()?)?;
    let options = SchedulerOptions { as_card: true, ..SchedulerOptions::default() };
    let mut scheduler = Scheduler::new(gpu, TABLE, pixels(256), options)?;
    let ramp = (0..100).collect::<Vec<u32>>();
    scheduler.upload(MODEL, 0, 0, &ramp)?;
    let snapshot = scheduler.snapshot(&[(MODEL, 100), (PLANES, 400)])?;
    let is_read = AtomicBool::new(false);
    thread::scope(|scope| {
        let reader = scope.spawn(|| {
            thread::sleep(UNREAD_TIME);
            is_read.store(true, Ordering::Relaxed);
            snapshot.read()
        });
        let grown = scheduler.set_counts(counts(200, 256)).and_then(|()| scheduler.download::<u32>(MODEL, 0, 0, 100));
        let waited = is_read.load(Ordering::Relaxed);
        let read = reader.join().expect("the reader")?;
        assert_eq!(grown.expect("the snapshot's memory was enough"), ramp);
        assert_eq!(read, [ramp, vec![0; 400]]);
        Ok(if waited { "waited" } else { "done" })
    })
}

fn outcome(fault: &str) -> String {
    outcome_of("work", fault)
}

fn outcome_of(kind: &str, fault: &str) -> String {
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new(program);
    command.args(["--exact", "scheduler::faults::child", "--nocapture", "--test-threads=1"]);
    command.env(CHILD_VARIABLE, kind).env("LABELGS_FAULT", fault).env("LABELGS_VALIDATION", "off");
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{fault}: {}\n{text}", output.status);
    let line = text.lines().find_map(|line| line.split_once("outcome: ").map(|(_, rest)| rest.to_owned()));
    line.unwrap_or_else(|| panic!("{fault}: no outcome in\n{text}"))
}

#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn failures_become_errors() {
    let Some(turn) = device() else { return };
    // The children have devices of their own; the turn keeps the cores free for them.
    for (fault, expected) in [
        ("vkNothing:1:DEVICE_LOST", "done"),
        ("vkCreateInstance:1:HOST_MEMORY", "4 "),
        ("vkCreateDevice:1:HOST_MEMORY", "4 "),
        ("vkCreateBuffer:1:DEVICE_MEMORY", "5 "),
        ("vkAllocateMemory:1:DEVICE_MEMORY", "5 "),
        ("vkAllocateMemory:4:DEVICE_MEMORY", "5 "),
        ("vkCreateComputePipelines:1:HOST_MEMORY", "5 "),
        ("vkCreateComputePipelines:1:INITIALIZATION", "4 "),
        ("vkCreateShaderModule:1:INITIALIZATION", "4 "),
        ("vkAllocateDescriptorSets:1:HOST_MEMORY", "5 "),
        ("vkCreateQueryPool:1:HOST_MEMORY", "5 "),
        ("vkEndCommandBuffer:3:HOST_MEMORY", "5 "),
        ("vkQueueSubmit:1:DEVICE_LOST", "6 "),
        ("vkWaitSemaphores:2:DEVICE_LOST", "6 "),
    ] {
        let outcome = outcome(fault);
        assert!(outcome.starts_with(expected), "{fault}: {outcome}");
        if fault.starts_with("vkCreateComputePipelines:1:INIT") {
            let driver = &turn.capabilities().driver_name;
            assert!(outcome.contains("does not compile the shader ") && outcome.contains(driver.as_str()), "{outcome}");
        }
    }
    drop(turn);
}

/// Fails the first, second, third... call of a name until there is none left, and returns the outcomes.
fn outcomes(call: &str, result: &str) -> Vec<String> {
    let all = (1..200).map(|nth| outcome(&format!("{call}:{nth}:{result}")));
    all.take_while(|outcome| outcome != "done").collect()
}

#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn memory_may_run_out_anywhere() {
    let Some(turn) = device() else { return };
    let outcomes = outcomes("vkAllocateMemory", "DEVICE_MEMORY");
    assert!(outcomes.len() > 20, "{outcomes:?}");
    assert!(outcomes.iter().all(|outcome| outcome.starts_with("5 ")), "{outcomes:?}");
    drop(turn);
}

#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn a_device_may_be_lost_anywhere() {
    let Some(turn) = device() else { return };
    let mut outcomes = outcomes("vkQueueSubmit", "DEVICE_LOST");
    outcomes.extend(self::outcomes("vkWaitSemaphores", "DEVICE_LOST"));
    assert!(outcomes.len() > 30, "{outcomes:?}");
    assert!(outcomes.iter().all(|outcome| outcome.starts_with("6 ")), "{outcomes:?}");
    let named = outcomes.iter().filter(|outcome| outcome.contains("is copy b to report of list toy")).count();
    assert!(named > 0, "some outcome names the last pass: {outcomes:?}");
    drop(turn);
}

/// Where growth finds no memory, it waits for the reader of a snapshot and goes on with what that frees.
#[test]
#[cfg_attr(not(feature = "lab"), ignore = "needs the feature `lab`")]
fn growth_without_memory_waits_for_snapshots() {
    let Some(turn) = device() else { return };
    let all = (1..200).map(|nth| outcome_of("grow", &format!("vkAllocateMemory:{nth}:DEVICE_MEMORY")));
    let outcomes: Vec<_> = all.take_while(|outcome| outcome != "done").collect();
    let waited = outcomes.iter().filter(|outcome| *outcome == "waited").count();
    assert!(waited >= 2, "one for each plane of the model: {outcomes:?}");
    assert!(outcomes.iter().all(|outcome| outcome == "waited" || outcome.starts_with("5 ")), "{outcomes:?}");
    drop(turn);
}
