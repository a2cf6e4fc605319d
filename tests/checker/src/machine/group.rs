//! A workgroup: its subgroups, its barriers and its shared memory.

use super::Machine;
use super::subgroup::{self, Fragment, Subgroup, lanes};
use crate::findings::{Kind, located};
use crate::lane::{Lane, Released};
use crate::memory::POISON;
use crate::program::{Instruction, Program};
use crate::shared::SharedMemory;

/// A workgroup.
#[derive(Debug)]
pub(super) struct Group<const W: usize> {
    pub(super) shared: SharedMemory,
    pub(super) subgroups: Vec<Subgroup<W>>,
}

impl<const W: usize> Group<W> {
    pub(super) fn new(program: &Program) -> Self {
        let count = program.local_size.iter().product::<u32>().div_ceil(W as u32);
        let subgroup = || Subgroup {
            registers: vec![[0; W]; program.registers as usize],
            ready: Vec::new(),
            waiting: Vec::new(),
            all: 0,
            alive: 0,
            lanes: vec![Lane::default(); W],
        };
        Self { shared: SharedMemory::default(), subgroups: (0..count).map(|_| subgroup()).collect() }
    }

    /// Begins again as another workgroup.
    pub(super) fn reset(&mut self, program: &Program, id: u32) {
        let count = program.local_size.iter().product::<u32>();
        self.shared.reset(program.shared_words, POISON);
        for (number, subgroup) in self.subgroups.iter_mut().enumerate() {
            let first = number as u32 * W as u32;
            let lanes = (count - first).min(W as u32);
            subgroup.all = u64::MAX >> (64 - lanes);
            subgroup.alive = subgroup.all;
            subgroup.waiting.clear();
            subgroup.ready = vec![Fragment { pc: 0, mask: subgroup.alive }];
            for (lane, state) in subgroup.lanes.iter_mut().enumerate() {
                let number = (first as usize + lane) as u16;
                *state = Lane::new(id, number, first as u16 / W as u16);
            }
        }
    }

    /// All invocations that exist.
    fn all(&self, program: &Program) -> impl Iterator<Item = &Lane> {
        let count = program.local_size.iter().product::<u32>() as usize;
        self.subgroups.iter().flat_map(|subgroup| &subgroup.lanes).take(count)
    }
}

/// Runs one of the subgroups for a while. Returns false if the workgroup has ended.
pub(super) fn step<const W: usize>(machine: &mut Machine<'_, W>, group: &mut Group<W>) -> bool {
    let ready = |subgroup: &Subgroup<W>| !subgroup.ready.is_empty();
    let count = group.subgroups.iter().filter(|subgroup| ready(subgroup)).count();
    if count == 0 {
        return release(machine, group);
    }
    let chosen = machine.below(count);
    let subgroup = group.subgroups.iter_mut().filter(|subgroup| ready(subgroup)).nth(chosen);
    if let Some(subgroup) = subgroup {
        subgroup::run(machine, &mut group.shared, subgroup);
    }
    true
}

/// Lets all invocations pass the barrier that they wait at. Returns false if all have ended.
fn release<const W: usize>(machine: &mut Machine<'_, W>, group: &mut Group<W>) -> bool {
    let program = machine.program;
    let waiting: Vec<Fragment> = group.subgroups.iter().flat_map(|subgroup| subgroup.waiting.iter().copied()).collect();
    check_fences(machine, group, waiting.first().map(|fragment| fragment.pc));
    let Some(first) = waiting.first() else { return false };
    check_barrier(machine, group, &waiting);
    let Instruction::Barrier(semantics) = program.code[first.pc as usize] else { return false };
    let orders = semantics.orders_buffers().then(|| semantics.is_device());
    let released = Released::new(group.all(program).filter(|lane| is_alive(group, lane)), orders);
    for subgroup in &mut group.subgroups {
        for lane in lanes(subgroup.alive) {
            let lane = &mut subgroup.lanes[lane];
            lane.epoch += u32::from(semantics.orders_shared());
            (lane.trail, lane.subgroup_trail) = (0, 0);
            released.pass(lane);
        }
        let next = subgroup.waiting.drain(..).map(|fragment| Fragment { pc: fragment.pc + 1, ..fragment });
        subgroup.ready.extend(next);
    }
    true
}

fn is_alive<const W: usize>(group: &Group<W>, lane: &Lane) -> bool {
    group.subgroups[usize::from(lane.subgroup)].alive >> (usize::from(lane.number) % W) & 1 == 1
}

/// All invocations must wait at the same barrier.
fn check_barrier<const W: usize>(machine: &mut Machine<'_, W>, group: &Group<W>, waiting: &[Fragment]) {
    let program = machine.program;
    let pc = waiting[0].pc;
    let invocations = program.local_size.iter().product::<u32>();
    let here: u32 =
        waiting.iter().filter(|fragment| fragment.pc == pc).map(|fragment| fragment.mask.count_ones()).sum();
    if here == invocations {
        return;
    }
    let id = group.subgroups[0].lanes[0].group;
    let other = waiting.iter().find(|fragment| fragment.pc != pc);
    machine.found(Kind::Barrier, pc, 0, || {
        let others = match other {
            Some(other) => format!("others at {}", located(program, program.origins[other.pc as usize])),
            None => "the others have ended".to_owned(),
        };
        format!("{here} of {invocations} invocations of workgroup {id} wait here, {others}")
    });
}

/// All invocations must have run the same fences since the last barrier.
fn check_fences<const W: usize>(machine: &mut Machine<'_, W>, group: &Group<W>, pc: Option<u32>) {
    let program = machine.program;
    let differs =
        |a: &Lane, b: &Lane| a.trail != b.trail || (a.subgroup == b.subgroup && a.subgroup_trail != b.subgroup_trail);
    let mut before: Option<&Lane> = None;
    let mut pair = None;
    for lane in group.all(program) {
        pair = pair.or(before.filter(|before| differs(before, lane)).map(|before| (before.name(), lane.name())));
        before = Some(lane);
    }
    let Some((one, other)) = pair else { return };
    let last = program.code.len() as u32 - 1;
    machine.found(Kind::Fence, pc.unwrap_or(last), 0, || {
        format!("{one} and {other} have run different memory fences since the last barrier")
    });
}
