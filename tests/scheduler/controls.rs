//! Negative controls: each mode of the validation layer finds the error that it is for.

use super::*;
use crate::support::device::{NO_LAYER, layer_is_required};
use labelgs::gpu::{Gpu, GpuOptions, Message, Validation};

/// Messages of a new device in a mode, or `None` without the layer.
fn messages(validation: Validation, list: &PassList) -> Option<Vec<Message>> {
    let gpu = Gpu::new(&GpuOptions { validation, ..GpuOptions::from_env().unwrap() }).unwrap();
    if !gpu.is_validated() {
        assert!(!layer_is_required(), "{NO_LAYER}");
        eprintln!("skipped: the validation layer is not installed");
        return None;
    }
    let log = gpu.message_log();
    let mut scheduler = Scheduler::new(gpu, TABLE, pixels(256), SchedulerOptions::default()).unwrap();
    let id = scheduler.prepare(list).unwrap();
    scheduler.run(id, 0).unwrap();
    drop(scheduler);
    Some(log.messages())
}

// The declaration says that it reads, but it writes, so the planner leaves out a barrier.
toy_shader!(
    liar,
    [],
    [("to", R, S, 4)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) buffer to_block { uint to[]; };
    void main() { to[gl_GlobalInvocationID.x] = gl_GlobalInvocationID.x; }"
);

toy_shader!(
    beyond,
    [],
    [("to", W, S, 4)],
    "layout(local_size_x = 64) in;
    layout(std430, set=0, binding=0) writeonly buffer to_block { uint to[]; };
    void main() { to[gl_GlobalInvocationID.x + 256u] = 7u; }"
);

#[test]
fn a_missing_barrier_is_reported() {
    let Some(turn) = device() else { return };
    let mut list = PassList::new("race");
    list.fill(A, 5);
    list.pass(PassDecl::new(liar(), vec![A], Grid::Groups(4, 1, 1)));
    list.pass(scaled(A, B, 3, 1, 256)).copy(B, REPORT, 0);
    let Some(found) = messages(Validation::Sync, &list) else { return };
    assert!(found.iter().any(|message| message.is_error && message.id.contains("SYNC-HAZARD")), "{found:?}");
    // Core validation alone does not find it.
    let Some(found) = messages(Validation::On, &list) else { return };
    assert!(!found.iter().any(|message| message.id.contains("SYNC-HAZARD")), "{found:?}");
    drop(turn);
}

#[test]
fn a_write_beyond_a_buffer_is_reported() {
    let Some(turn) = device() else { return };
    let mut list = PassList::new("beyond");
    list.pass(PassDecl::new(beyond(), vec![A], Grid::Groups(1, 1, 1)));
    list.copy(A, REPORT, 0);
    let Some(found) = messages(Validation::GpuAssisted, &list) else { return };
    assert!(found.iter().any(|message| message.is_error && message.text.contains("out of bounds")), "{found:?}");
    drop(turn);
}
