//! Subgroup operations: all lanes of a subgroup meet at one of them.

use super::Machine;
use super::subgroup::{Active, Fragment, Subgroup, lanes};
use crate::findings::Kind;
use crate::memory::POISON;
use crate::program::{Exchange, Instruction};

/// Runs the operations that fragments wait for, when no fragment can run. Returns false if all wait for a barrier.
pub(super) fn meet<const W: usize>(machine: &mut Machine<'_, W>, subgroup: &mut Subgroup<W>) -> bool {
    let program = machine.program;
    let is_exchange = |fragment: &Fragment| matches!(program.code[fragment.pc as usize], Instruction::Exchange { .. });
    let mut meeting: Vec<Fragment> = Vec::new();
    for fragment in subgroup.waiting.extract_if(.., |fragment| is_exchange(fragment)) {
        match meeting.iter_mut().find(|other| other.pc == fragment.pc) {
            Some(other) => other.mask |= fragment.mask,
            None => meeting.push(fragment),
        }
    }
    for fragment in &meeting {
        if fragment.mask != subgroup.all {
            let (here, all) = (fragment.mask, subgroup.all);
            let first = subgroup.lanes[0].clone();
            machine.found(Kind::Subgroup, fragment.pc, 0, || {
                let (group, subgroup) = (first.group, first.subgroup);
                format!("lanes {here:#x} of {all:#x} meet in subgroup {subgroup} of workgroup {group}")
            });
        }
        exchange(machine, subgroup, *fragment);
        subgroup.ready.push(Fragment { pc: fragment.pc + 1, ..*fragment });
    }
    !meeting.is_empty()
}

fn exchange<const W: usize>(machine: &Machine<'_, W>, subgroup: &mut Subgroup<W>, Fragment { pc, mask }: Fragment) {
    let Instruction::Exchange { op, to, a, b } = &machine.program.code[pc as usize] else { return };
    let (a, b) = (*subgroup.get(machine.constants, *a), *subgroup.get(machine.constants, *b));
    let first = mask.trailing_zeros() as usize;
    // The value of a lane that does not take part is undefined.
    let of = |lane: usize| if lane < W && mask >> lane & 1 == 1 { a[lane] } else { POISON };
    let truths = lanes(mask).filter(|lane| a[*lane] != 0).fold(0_u64, |bits, lane| bits | 1 << lane);
    let value: [u32; W] = match *op {
        Exchange::Elect => std::array::from_fn(|lane| u32::from(lane == first)),
        Exchange::Ballot(from) => [(truths >> from) as u32; W],
        Exchange::Shuffle => std::array::from_fn(|lane| of(b[lane] as usize)),
        Exchange::ShuffleXor => std::array::from_fn(|lane| of(lane ^ b[lane] as usize)),
        Exchange::BroadcastFirst => [a[first]; W],
        Exchange::All => [u32::from(truths == mask); W],
        Exchange::Any => [u32::from(truths != 0); W],
        Exchange::Reduce(op) => {
            let values = lanes(mask).map(|lane| a[lane]);
            [values.reduce(|sum, value| op.one([sum, value])).unwrap_or_default(); W]
        }
        Exchange::InclusiveScan(op) => {
            let (mut found, mut sum) = ([POISON; W], None);
            for lane in lanes(mask) {
                let next = sum.map_or(a[lane], |sum| op.one([sum, a[lane]]));
                (found[lane], sum) = (next, Some(next));
            }
            found
        }
        Exchange::ExclusiveScan(op, least) => {
            let (mut found, mut sum) = ([POISON; W], least);
            for lane in lanes(mask) {
                found[lane] = sum;
                sum = op.one([sum, a[lane]]);
            }
            found
        }
        Exchange::Barrier => {
            lanes(mask).for_each(|lane| subgroup.lanes[lane].subgroup_epoch += 1);
            return;
        }
    };
    let active = Active::new(mask, subgroup.alive);
    subgroup.set(*to, value, &active);
}
