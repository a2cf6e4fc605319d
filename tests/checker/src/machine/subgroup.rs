//! Registers and control flow of a subgroup.

use super::Machine;
use super::exchange;
use crate::findings::Kind;
use crate::lane::Lane;
use crate::program::{Instruction, Register, Source, Space};
use crate::shared::SharedMemory;

/// Lanes at the same instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fragment {
    pub(super) pc: u32,
    /// A bit for each lane.
    pub(super) mask: u64,
}

/// A subgroup.
#[derive(Debug)]
pub(super) struct Subgroup<const W: usize> {
    pub(super) registers: Vec<[u32; W]>,
    /// Fragments that can run.
    pub(super) ready: Vec<Fragment>,
    /// Fragments that wait at a barrier or a subgroup operation.
    pub(super) waiting: Vec<Fragment>,
    /// Lanes that exist.
    pub(super) all: u64,
    /// Lanes that have not ended.
    pub(super) alive: u64,
    pub(super) lanes: Vec<Lane>,
}

/// Lanes that an instruction is run for.
pub(super) struct Active<const W: usize> {
    pub(super) mask: u64,
    /// True if no other lane of the subgroup will run anything: their registers may be overwritten.
    all: bool,
    /// All bits set for active lanes.
    select: [u32; W],
}

impl<const W: usize> Active<W> {
    pub(super) fn new(mask: u64, alive: u64) -> Self {
        let select = std::array::from_fn(|lane| if mask >> lane & 1 == 1 { u32::MAX } else { 0 });
        Self { mask, all: mask == alive, select }
    }
}

/// The set bits of a mask.
pub(super) fn lanes(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (lane < 64).then_some(lane as usize)
    })
}

impl<const W: usize> Subgroup<W> {
    /// The values of a word, in all lanes.
    #[inline(always)]
    pub(super) fn get<'a>(&'a self, constants: &'a [[u32; W]], source: Source) -> &'a [u32; W] {
        match source.place() {
            Ok(place) => &constants[place],
            Err(register) => &self.registers[register],
        }
    }

    /// Sets a register in the active lanes.
    #[inline(always)]
    pub(super) fn set(&mut self, to: Register, value: [u32; W], active: &Active<W>) {
        let register = &mut self.registers[to as usize];
        if active.all {
            *register = value;
        } else {
            for lane in 0..W {
                register[lane] = value[lane] & active.select[lane] | register[lane] & !active.select[lane];
            }
        }
    }

    /// Takes the fragment that is furthest behind, with all lanes at its instruction.
    fn take(&mut self) -> Option<Fragment> {
        let pc = self.ready.iter().map(|fragment| fragment.pc).min()?;
        let mut mask = 0;
        self.ready.retain(|fragment| {
            if fragment.pc == pc {
                mask |= fragment.mask;
            }
            fragment.pc != pc
        });
        Some(Fragment { pc, mask })
    }

    /// Lanes part: each part goes on at its instruction.
    fn part(&mut self, parts: &[(u32, u64)]) {
        let parts = parts.iter().filter(|(_, mask)| *mask != 0);
        self.ready.extend(parts.map(|&(pc, mask)| Fragment { pc, mask }));
    }

    /// Lanes whose value is not 0.
    fn truths(value: &[u32; W], mask: u64) -> u64 {
        (0..W).fold(0, |bits, lane| bits | u64::from(value[lane] != 0) << lane) & mask
    }
}

/// Runs a subgroup until it waits for others, ends, or has done an atomic on a buffer. Returns true in the last case.
pub(super) fn run<const W: usize>(
    machine: &mut Machine<'_, W>,
    shared: &mut SharedMemory,
    subgroup: &mut Subgroup<W>,
) -> bool {
    loop {
        let Some(fragment) = subgroup.take() else {
            if exchange::meet(machine, subgroup) {
                continue;
            }
            return false;
        };
        if run_fragment(machine, shared, subgroup, fragment) {
            return true;
        }
    }
}

/// Runs lanes until they part, wait or end. Returns true after an atomic on a buffer.
fn run_fragment<const W: usize>(
    machine: &mut Machine<'_, W>,
    shared: &mut SharedMemory,
    subgroup: &mut Subgroup<W>,
    fragment: Fragment,
) -> bool {
    let Fragment { mut pc, mask } = fragment;
    let (program, constants) = (machine.program, machine.constants);
    let active = Active::new(mask, subgroup.alive);
    loop {
        match &program.code[pc as usize] {
            Instruction::Jump(to) if subgroup.ready.is_empty() => {
                pc = *to;
                continue;
            }
            Instruction::Jump(to) => {
                subgroup.part(&[(*to, mask)]);
                return false;
            }
            Instruction::Branch { condition, yes, no } => {
                let truths = Subgroup::truths(subgroup.get(constants, *condition), mask);
                let rest = mask & !truths;
                if subgroup.ready.is_empty() && (truths == 0 || rest == 0) {
                    pc = if rest == 0 { *yes } else { *no };
                    continue;
                }
                subgroup.part(&[(*yes, truths), (*no, rest)]);
                return false;
            }
            Instruction::Switch { value, default, cases } => {
                let values = subgroup.get(constants, *value);
                let of = |case: u32| Subgroup::truths(&values.map(|value| u32::from(value == case)), mask);
                let mut parts: Vec<(u32, u64)> = cases.iter().map(|&(case, to)| (to, of(case))).collect();
                parts.push((*default, parts.iter().fold(mask, |rest, (_, part)| rest & !part)));
                subgroup.part(&parts);
                return false;
            }
            Instruction::Return => {
                subgroup.alive &= !mask;
                return false;
            }
            Instruction::Barrier(_) | Instruction::Exchange { .. } => {
                subgroup.waiting.push(Fragment { pc, mask });
                return false;
            }
            Instruction::Fence { semantics, is_part } => fence(subgroup, mask, (*semantics, *is_part), pc),
            Instruction::Atomic { .. } => {
                if atomic(machine, (shared, subgroup), fragment.mask, pc) {
                    return true;
                }
            }
            Instruction::Load { to, place, width } => {
                let value = machine.load((shared, subgroup), mask, place, *width, pc);
                subgroup.set(*to, value, &active);
            }
            Instruction::Store { place, from, width } => {
                machine.store((shared, subgroup), mask, place, *from, *width, pc);
            }
            Instruction::Fetch { to, binding, index, component } => {
                let value = machine.fetch(subgroup, mask, *binding, (*index, *component), pc);
                subgroup.set(*to, value, &active);
            }
            other => compute(machine, subgroup, &active, other, pc),
        }
        pc += 1;
    }
}

/// Runs an atomic. On a buffer, lanes part, others may come between, and the result is true.
fn atomic<const W: usize>(
    machine: &mut Machine<'_, W>,
    (shared, subgroup): (&mut SharedMemory, &mut Subgroup<W>),
    mask: u64,
    pc: u32,
) -> bool {
    let Instruction::Atomic { op, to, place, value, comparator } = &machine.program.code[pc as usize] else {
        return false;
    };
    let is_buffer = matches!(place.space, Space::Buffer(_));
    let now = if is_buffer { machine.some_of(mask) } else { mask };
    let active = Active::new(now, subgroup.alive);
    machine.atomic((shared, subgroup), &active, (*op, *to, place, *value, *comparator), pc);
    if is_buffer {
        subgroup.part(&[(pc + 1, now), (pc, mask & !now)]);
    }
    is_buffer
}

/// Runs an instruction that only computes.
#[inline(always)]
fn compute<const W: usize>(
    machine: &mut Machine<'_, W>,
    subgroup: &mut Subgroup<W>,
    active: &Active<W>,
    instruction: &Instruction,
    pc: u32,
) {
    let constants = machine.constants;
    let (to, value) = match instruction {
        Instruction::Unary { op, to, a } => (to, op.each([subgroup.get(constants, *a)])),
        Instruction::Binary { op, to, a, b } => {
            (to, op.each([subgroup.get(constants, *a), subgroup.get(constants, *b)]))
        }
        Instruction::Ternary { op, to, a, b, c } => {
            (to, op.each([a, b, c].map(|source| subgroup.get(constants, *source))))
        }
        Instruction::Move { to, from } => (to, *subgroup.get(constants, *from)),
        Instruction::Offset { to, base, index, stride, bound } => {
            let index = *subgroup.get(constants, *index);
            if *bound != u32::MAX
                && let Some(lane) = lanes(active.mask).find(|lane| index[*lane] >= *bound)
            {
                let (index, from) = (index[lane].cast_signed(), subgroup.lanes[lane].name());
                machine.found(Kind::Bounds, pc, 0, || format!("{from} uses index {index} of {bound} elements"));
            }
            let base = base.map_or([0; W], |base| *subgroup.get(constants, base));
            (to, std::array::from_fn(|lane| base[lane].saturating_add(index[lane].saturating_mul(*stride))))
        }
        Instruction::Length { to, binding, plus, stride } => {
            let bytes = machine.bound[usize::from(*binding)].bytes.saturating_sub(u64::from(*plus));
            (to, [(bytes / u64::from(*stride)) as u32; W])
        }
        _ => return,
    };
    subgroup.set(*to, value, active);
}

fn fence<const W: usize>(
    subgroup: &mut Subgroup<W>,
    mask: u64,
    (semantics, is_part): (crate::program::Semantics, bool),
    pc: u32,
) {
    for lane in lanes(mask) {
        let lane = &mut subgroup.lanes[lane];
        if !is_part {
            let trail = if semantics.scope == 3 { &mut lane.subgroup_trail } else { &mut lane.trail };
            *trail = trail.wrapping_mul(0x0100_0193) ^ (pc + 1);
        }
        if semantics.orders_buffers() {
            lane.fence(semantics.is_device());
        }
    }
}
