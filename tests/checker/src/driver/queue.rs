//! Submits run here.

use super::command::{self, Bindings, Command};
use super::device::{Device, Queue, State};
use super::properties::MAX_GROUPS;
use super::sync::{Queries, Timeline};
use super::{chain, lock, log, object, slice};
use crate::findings::Kind;
use crate::machine::{Bound, Dispatch};
use ash::vk;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

pub(super) unsafe extern "system" fn wait_idle(queue: vk::Queue) -> vk::Result {
    unsafe { (*object::<Queue>(queue).device).result() }
}

pub(super) unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo<'_>,
    _: vk::Fence,
) -> vk::Result {
    let device: &Device = unsafe { &*object::<Queue>(queue).device };
    for info in unsafe { slice(submits, count) } {
        let mut values: (&[u64], &[u64]) = (&[], &[]);
        for next in unsafe { chain(info.p_next) } {
            if unsafe { (*next).s_type } == vk::StructureType::TIMELINE_SEMAPHORE_SUBMIT_INFO {
                let given = unsafe { &*next.cast::<vk::TimelineSemaphoreSubmitInfo<'_>>() };
                values.0 = unsafe { slice(given.p_wait_semaphore_values, given.wait_semaphore_value_count) };
                values.1 = unsafe { slice(given.p_signal_semaphore_values, given.signal_semaphore_value_count) };
            }
        }
        let before = unsafe { slice(info.p_wait_semaphores, info.wait_semaphore_count) };
        for (semaphore, value) in before.iter().zip(values.0) {
            while !unsafe { object::<Timeline>(*semaphore) }.wait(*value, Duration::from_millis(5)) {
                if device.result() != vk::Result::SUCCESS {
                    return vk::Result::ERROR_DEVICE_LOST;
                }
            }
        }
        let mut state = lock(&device.state);
        for buffer in unsafe { slice(info.p_command_buffers, info.command_buffer_count) } {
            for command in command::commands(*buffer) {
                if state.is_lost {
                    return vk::Result::ERROR_DEVICE_LOST;
                }
                run(&mut state, command);
            }
        }
        if state.is_lost {
            return vk::Result::ERROR_DEVICE_LOST;
        }
        drop(state);
        let after = unsafe { slice(info.p_signal_semaphores, info.signal_semaphore_count) };
        for (semaphore, value) in after.iter().zip(values.1) {
            unsafe { object::<Timeline>(*semaphore) }.set(*value);
        }
    }
    vk::Result::SUCCESS
}

fn run(state: &mut State, command: Command) {
    match command {
        Command::Dispatch { with, groups } => dispatch(state, &with, groups),
        Command::Indirect { with, groups } => {
            let found = [0, 4, 8].map(|byte| word(state, &groups, byte));
            let groups = found.map(|(count, _)| count);
            let fits = groups.iter().zip(MAX_GROUPS).all(|(count, most)| *count <= most);
            if fits && found.iter().all(|(_, is_written)| *is_written) {
                return dispatch(state, &with, groups);
            }
            let hash = with.pipeline.map_or(0, |program| program.hash);
            log::say(
                hash,
                &format!("an indirect dispatch of {groups:?} workgroups, which nobody wrote or are too many"),
            );
            state.is_lost = true;
        }
        Command::Copy { from, to } => {
            for byte in (0..to.bytes).step_by(4) {
                let word = word(state, &from, byte);
                if let Some(memory) = &mut state.memories[to.memory] {
                    memory.copy_word(to.offset + byte, word);
                }
            }
        }
        Command::Fill { to, word } => {
            if let Some(memory) = &mut state.memories[to.memory] {
                (0..to.bytes / 4).for_each(|place| memory.set_word(to.offset + 4 * place, word));
            }
        }
        // SAFETY: the program keeps the pool until the submit has ended.
        Command::Reset { pool, first, count } => {
            lock(unsafe { object::<Queries>(pool) })[first as usize..][..count as usize].fill(0);
        }
        Command::Timestamp { pool, query } => {
            static START: LazyLock<Instant> = LazyLock::new(Instant::now);
            let now = START.elapsed().as_nanos() as u64;
            // SAFETY: likewise.
            lock(unsafe { object::<Queries>(pool) })[query as usize] = now;
        }
    }
}

/// A word of a range, and whether it was written.
fn word(state: &State, range: &Bound, byte: u64) -> (u32, bool) {
    let at = range.offset + byte;
    state.memories[range.memory].as_ref().map_or((0, false), |memory| (memory.word(at), memory.is_written(at)))
}

fn dispatch(state: &mut State, with: &Bindings, groups: [u32; 3]) {
    let Some(program) = &with.pipeline else { return };
    let Some(bound) = command::bound(with) else {
        log::say(program.hash, "a binding that the shader uses has no buffer");
        state.is_lost = true;
        return;
    };
    log::ran(program.hash);
    state.dispatches += 1;
    let options = log::options();
    let seed = options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(state.dispatches);
    let dispatch = Dispatch { program, bound, push: &with.push, groups, lanes: options.lanes, seed };
    match dispatch.run(&mut state.memories, &mut state.races) {
        Ok(mut findings) => {
            findings.retain(|finding| finding.kind != Kind::Stale || !options.may_be_stale);
            findings.iter().for_each(|finding| log::report(program.hash, finding));
            state.is_lost |= !findings.is_empty() && !options.keeps_going;
        }
        Err(what) => {
            log::say(program.hash, &what);
            state.is_lost = true;
        }
    }
}
