//! Runs dispatches.
//!
//! The lanes of a subgroup that are at the same instruction run together, as a [`subgroup::Fragment`]; no lane runs an
//! instruction that its own control flow does not reach. Fragments split at branches and meet again by chance of the
//! code's order, which is only a matter of speed. Several workgroups are resident. A seed chooses which of them, and
//! which of their subgroups, runs next; a subgroup runs until it waits, ends, or has done an atomic on a buffer.

mod access;
mod exchange;
mod group;
mod subgroup;

use crate::findings::{Finding, Findings, Kind};
use crate::memory::Memory;
use crate::program::{Builtin, Program};
use crate::races::Races;
use group::Group;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::RngCore;

/// Workgroups that run at the same time.
const RESIDENT_GROUPS: usize = 4;

/// Format of a texel buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Words of an element.
    pub words: u32,
    /// True if a missing last component is the float 1.
    pub is_float: bool,
}

/// A range of memory that is bound.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Place of the memory.
    pub memory: usize,
    /// First byte.
    pub offset: u64,
    /// Bytes.
    pub bytes: u64,
    /// Format of a texel buffer.
    pub texels: Option<Format>,
}

/// All memory of a device. A place may be empty.
pub type Memories = Vec<Option<Memory>>;

/// A dispatch.
#[derive(Debug)]
pub struct Dispatch<'a> {
    /// The shader.
    pub program: &'a Program,
    /// Buffers, in the order of the program's bindings.
    pub bound: Vec<Bound>,
    /// Words of push constants.
    pub push: &'a [u32],
    /// Workgroups along each axis.
    pub groups: [u32; 3],
    /// Lanes of a subgroup: 4, 8, 16, 32 or 64.
    pub lanes: u32,
    /// Seed of the schedule.
    pub seed: u64,
}

impl Dispatch<'_> {
    /// Runs it and returns what is wrong.
    pub fn run(self, memories: &mut Memories, races: &mut Races) -> Result<Vec<Finding>, String> {
        match self.lanes {
            4 => Ok(self.run_with::<4>(memories, races)),
            8 => Ok(self.run_with::<8>(memories, races)),
            16 => Ok(self.run_with::<16>(memories, races)),
            32 => Ok(self.run_with::<32>(memories, races)),
            64 => Ok(self.run_with::<64>(memories, races)),
            other => Err(format!("subgroups of {other} lanes")),
        }
    }

    fn run_with<const W: usize>(self, memories: &mut Memories, races: &mut Races) -> Vec<Finding> {
        races.begin();
        let constants = self.program.constants.iter().map(|value| [*value; W]).collect::<Vec<_>>();
        let mut machine = Machine {
            is_tracked: self.tracked(),
            constants: &constants,
            program: self.program,
            bound: &self.bound,
            push: self.push,
            groups: self.groups,
            memories,
            races,
            findings: Findings::default(),
            random: Pcg32::new(self.seed, 0x0a02_bdbf_7bb3_c0a7),
        };
        machine.run();
        machine.findings.list
    }

    /// Tells for each buffer whether accesses may conflict: the shader writes memory of its range.
    fn tracked(&self) -> Vec<bool> {
        let all = || self.bound.iter().zip(&self.program.bindings);
        let overlap = |a: &Bound, b: &Bound| {
            a.memory == b.memory && a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes
        };
        all().map(|(a, _)| all().any(|(b, used)| used.is_written && overlap(a, b))).collect()
    }
}

/// A running dispatch.
struct Machine<'a, const W: usize> {
    program: &'a Program,
    constants: &'a [[u32; W]],
    bound: &'a [Bound],
    is_tracked: Vec<bool>,
    push: &'a [u32],
    groups: [u32; 3],
    memories: &'a mut Memories,
    races: &'a mut Races,
    findings: Findings,
    random: Pcg32,
}

impl<const W: usize> Machine<'_, W> {
    fn run(&mut self) {
        let count = self.groups.iter().product::<u32>();
        let mut order = (0..count).collect::<Vec<_>>();
        for place in (1..order.len()).rev() {
            let other = self.below(place + 1);
            order.swap(place, other);
        }
        let mut next = order.into_iter();
        let mut resident = Vec::new();
        for id in next.by_ref().take(RESIDENT_GROUPS) {
            let mut group = Group::new(self.program);
            self.start(&mut group, id);
            resident.push(group);
        }
        while !resident.is_empty() {
            let place = self.below(resident.len());
            if group::step(self, &mut resident[place]) {
                continue;
            }
            match next.next() {
                Some(id) => self.start(&mut resident[place], id),
                None => drop(resident.swap_remove(place)),
            }
        }
    }

    /// A random number below a bound.
    fn below(&mut self, bound: usize) -> usize {
        match bound {
            0 | 1 => 0,
            _ => ((u64::from(self.random.next_u32()) * bound as u64) >> 32) as usize,
        }
    }

    /// Begins a workgroup.
    fn start(&mut self, group: &mut Group<W>, id: u32) {
        let [x, y, _] = self.groups;
        let position = [id % x, id / x % y, id / x / y];
        group.reset(self.program, id);
        let size = self.program.local_size;
        let count = size.iter().product::<u32>();
        for (number, subgroup) in group.subgroups.iter_mut().enumerate() {
            for &(builtin, first) in &self.program.builtins {
                for lane in 0..W as u32 {
                    let index = number as u32 * W as u32 + lane;
                    let local = [index % size[0], index / size[0] % size[1], index / size[0] / size[1]];
                    let global = [0, 1, 2].map(|axis| position[axis] * size[axis] + local[axis]);
                    let value = match builtin {
                        Builtin::NumWorkgroups => self.groups,
                        Builtin::WorkgroupId => position,
                        Builtin::LocalInvocationId => local,
                        Builtin::GlobalInvocationId => global,
                        Builtin::LocalInvocationIndex => [index, 0, 0],
                        Builtin::SubgroupId => [number as u32, 0, 0],
                        Builtin::SubgroupLocalInvocationId => [lane, 0, 0],
                        Builtin::SubgroupSize => [W as u32, 0, 0],
                        Builtin::NumSubgroups => [count.div_ceil(W as u32), 0, 0],
                    };
                    let words = if builtin.is_vector() { 3 } else { 1 };
                    for (word, value) in value.into_iter().take(words).enumerate() {
                        subgroup.registers[first as usize + word][lane as usize] = value;
                    }
                }
            }
        }
    }

    fn found(&mut self, kind: Kind, pc: u32, subject: u64, what: impl FnOnce() -> String) {
        self.findings.add(self.program, kind, pc, subject, what);
    }
}
