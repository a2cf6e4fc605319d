//! Every failure of Vulkan that tests can ask for ends in an error, never in a crash or a hang.

use super::*;
use std::process::Command;

const CHILD: &str = "LABELGS_FAULT_CHILD";

/// Does a little of everything; a test of its own so that it can run in a process of its own.
#[test]
fn child() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    match work() {
        Ok(()) => println!("outcome: done"),
        Err(error) => println!("outcome: {} {error}", error.exit_status()),
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
    scheduler.set_capacity(pixels(512))?;
    let id = scheduler.prepare(&list)?;
    for step in 0..4 {
        scheduler.submit(id, step % 2)?;
    }
    scheduler.wait_all()?;
    scheduler.timings(id, 0)?;
    scheduler.download_all::<u32>(REPORT, 0).map(|_| ())
}

fn outcome(fault: &str) -> String {
    let program = std::env::current_exe().unwrap();
    let mut command = Command::new(program);
    command.args(["--exact", "sched::faults::child", "--nocapture", "--test-threads=1"]);
    command.env(CHILD, "1").env("LABELGS_FAULT", fault).env("LABELGS_VALIDATION", "off");
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{fault}: {}\n{text}", output.status);
    let line = text.lines().find_map(|line| line.split_once("outcome: ").map(|(_, rest)| rest.to_owned()));
    line.unwrap_or_else(|| panic!("{fault}: no outcome in\n{text}"))
}

#[test]
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
        ("vkAllocateDescriptorSets:1:HOST_MEMORY", "5 "),
        ("vkCreateQueryPool:1:HOST_MEMORY", "5 "),
        ("vkEndCommandBuffer:3:HOST_MEMORY", "5 "),
        ("vkQueueSubmit:1:DEVICE_LOST", "6 "),
        ("vkWaitSemaphores:2:DEVICE_LOST", "6 "),
    ] {
        let outcome = outcome(fault);
        assert!(outcome.starts_with(expected), "{fault}: {outcome}");
    }
    drop(turn);
}

#[test]
fn a_lost_device_names_the_last_pass() {
    let Some(turn) = device() else { return };
    // Find the wait that belongs to the first run: the waits before it are those of fresh memory.
    let outcomes = (1..60).map(|nth| outcome(&format!("vkWaitSemaphores:{nth}:DEVICE_LOST")));
    let mut named = outcomes.take_while(|outcome| outcome != "done").filter(|outcome| outcome.contains("of list toy"));
    let first = named.next().expect("some outcome names a pass");
    assert!(first.starts_with("6 "), "{first}");
    drop(turn);
}
