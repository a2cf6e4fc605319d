//! Gives registers that are not in use at the same time the same place, so that those of a subgroup fit into a cache.
//!
//! Lanes may be at different instructions, but each lane's registers are its own. A register is in use from its first
//! to its last instruction in the order of the code, and in every block that its value reaches.

use crate::program::{Instruction, Place, Program, Register, Source};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Drops what only computes words that nobody reads: members of structs that are loaded as a whole, most of all.
pub fn drop_dead(program: &mut Program) {
    let mut counts: Vec<u32> = Vec::new();
    for instruction in &mut program.code {
        instruction.visit(&mut |source: &mut Source| count(&mut counts, *source, 1));
    }
    let mut keeps = vec![true; program.code.len()];
    let mut changed = true;
    while changed {
        changed = false;
        for (instruction, keeps) in program.code.iter_mut().zip(&mut keeps).rev().filter(|(_, keeps)| **keeps) {
            let only_computes = !matches!(instruction, Instruction::Atomic { .. } | Instruction::Exchange { .. });
            let result = instruction.result().copied().filter(|to| only_computes && *to >= program.registers);
            if result.is_some_and(|to| counts.get(to as usize).is_none_or(|uses| *uses == 0)) {
                instruction.visit(&mut |source: &mut Source| count(&mut counts, *source, u32::MAX));
                (*keeps, changed) = (false, true);
            }
        }
    }
    // New places of all instructions: a dropped one is the next that is kept.
    let before = |sum: &mut u32, keeps: &bool| Some(std::mem::replace(sum, *sum + u32::from(*keeps)));
    let places: Vec<u32> = keeps.iter().scan(0, before).collect();
    let mut all = keeps.iter().copied();
    program.origins.retain(|_| all.next().unwrap_or(true));
    let mut all = keeps.iter().copied();
    program.code.retain(|_| all.next().unwrap_or(true));
    for target in program.code.iter_mut().flat_map(Instruction::targets) {
        *target = places[*target as usize];
    }
}

/// Adds to the number of uses of a register.
fn count(counts: &mut Vec<u32>, source: Source, more: u32) {
    if let Err(register) = source.place() {
        counts.resize(counts.len().max(register + 1), 0);
        counts[register] = counts[register].wrapping_add(more);
    }
}

/// Replaces virtual registers by real ones.
pub fn allocate(program: &mut Program) {
    let pinned = program.registers;
    program.pinned = pinned;
    let spans = spans(program, pinned);
    let mut order: Vec<usize> = (0..spans.len()).filter(|place| spans[*place].0 <= spans[*place].1).collect();
    order.sort_by_key(|place| spans[*place].0);
    let (mut places, mut count) = (vec![0; spans.len()], pinned);
    let (mut busy, mut free) = (BinaryHeap::new(), Vec::new());
    for virtual_place in order {
        let (first, last) = spans[virtual_place];
        // A result never shares the place of an operand.
        while let Some(&Reverse((end, place))) = busy.peek() {
            if end >= first {
                break;
            }
            busy.pop();
            free.push(place);
        }
        let place = free.pop().unwrap_or_else(|| {
            count += 1;
            count - 1
        });
        places[virtual_place] = place;
        busy.push(Reverse((last, place)));
    }
    let real = |register: &mut Register| {
        if *register >= pinned {
            *register = places[(*register - pinned) as usize];
        }
    };
    for instruction in &mut program.code {
        instruction.visit(&mut |source: &mut Source| {
            if source.place().is_err() {
                real(&mut source.0);
            }
        });
        if let Some(to) = instruction.result() {
            real(to);
        }
    }
    program.registers = count;
}

/// First and last instruction at which each virtual register is in use.
fn spans(program: &mut Program, pinned: Register) -> Vec<(u32, u32)> {
    let blocks = blocks(program);
    let mut uses: Vec<(Vec<u32>, Option<u32>)> = Vec::with_capacity(program.code.len());
    let mut count = 0;
    for instruction in &mut program.code {
        let mut read = Vec::new();
        instruction.visit(&mut |source: &mut Source| {
            if let Err(register) = source.place()
                && register as u32 >= pinned
            {
                read.push(register as u32 - pinned);
            }
        });
        let written = instruction.result().filter(|to| **to >= pinned).map(|to| *to - pinned);
        count = read.iter().chain(&written).fold(count, |count, register| count.max(register + 1));
        uses.push((read, written));
    }
    let words = (count as usize).div_ceil(64);
    let mut live_in = vec![vec![0_u64; words]; blocks.len()];
    let mut live_out = live_in.clone();
    let mut changed = true;
    while changed {
        changed = false;
        for (number, block) in blocks.iter().enumerate().rev() {
            let mut live = vec![0_u64; words];
            for next in &block.next {
                live.iter_mut().zip(&live_in[*next]).for_each(|(live, more)| *live |= more);
            }
            live_out[number].clone_from(&live);
            for (read, written) in uses[block.first as usize..=block.last as usize].iter().rev() {
                written.iter().for_each(|register| live[*register as usize / 64] &= !(1 << (register % 64)));
                read.iter().for_each(|register| live[*register as usize / 64] |= 1 << (register % 64));
            }
            if live != live_in[number] {
                (live_in[number], changed) = (live, true);
            }
        }
    }
    let mut spans = vec![(u32::MAX, 0); count as usize];
    let mut extend = |register: usize, at: u32| {
        let (first, last) = spans[register];
        spans[register] = (first.min(at), last.max(at));
    };
    for (at, (read, written)) in uses.iter().enumerate() {
        read.iter().chain(written).for_each(|register| extend(*register as usize, at as u32));
    }
    for (number, block) in blocks.iter().enumerate() {
        for (live, at) in [(&live_in[number], block.first), (&live_out[number], block.last)] {
            (0..count as usize)
                .filter(|place| live[place / 64] >> (place % 64) & 1 == 1)
                .for_each(|place| extend(place, at));
        }
    }
    spans
}

/// Instructions without a branch between them.
struct Block {
    first: u32,
    last: u32,
    next: Vec<usize>,
}

fn blocks(program: &mut Program) -> Vec<Block> {
    let mut starts: Vec<u32> = vec![0];
    for (at, instruction) in program.code.iter_mut().enumerate() {
        let targets: Vec<u32> = instruction.targets().into_iter().map(|to| *to).collect();
        if !targets.is_empty() || matches!(instruction, Instruction::Return) {
            starts.push(at as u32 + 1);
        }
        starts.extend(targets);
    }
    starts.retain(|start| (*start as usize) < program.code.len());
    starts.sort_unstable();
    starts.dedup();
    let count = program.code.len() as u32;
    let block = |(place, &first): (usize, &u32)| {
        let last = starts.get(place + 1).copied().unwrap_or(count) - 1;
        let instruction = &mut program.code[last as usize];
        let mut next: Vec<u32> = instruction.targets().into_iter().map(|to| *to).collect();
        if next.is_empty() && !matches!(instruction, Instruction::Return) {
            next.push(last + 1);
        }
        let next = next.iter().filter_map(|start| starts.binary_search(start).ok()).collect();
        Block { first, last, next }
    };
    starts.iter().enumerate().map(block).collect()
}

impl Instruction {
    /// The register that the instruction writes.
    fn result(&mut self) -> Option<&mut Register> {
        match self {
            Self::Unary { to, .. }
            | Self::Binary { to, .. }
            | Self::Ternary { to, .. }
            | Self::Move { to, .. }
            | Self::Offset { to, .. }
            | Self::Load { to, .. }
            | Self::Atomic { to, .. }
            | Self::Length { to, .. }
            | Self::Fetch { to, .. }
            | Self::Exchange { to, .. } => Some(to),
            _ => None,
        }
    }

    /// Where the instruction may go on, if not at the next.
    pub(super) fn targets(&mut self) -> Vec<&mut u32> {
        match self {
            Self::Jump(to) => vec![to],
            Self::Branch { yes, no, .. } => vec![yes, no],
            Self::Switch { default, cases, .. } => cases.iter_mut().map(|(_, to)| to).chain([default]).collect(),
            _ => Vec::new(),
        }
    }

    /// Calls a function with every word that the instruction reads.
    fn visit(&mut self, with: &mut impl FnMut(&mut Source)) {
        let place = |place: &mut Place, with: &mut dyn FnMut(&mut Source)| place.at.iter_mut().for_each(with);
        match self {
            Self::Unary { a, .. } | Self::Move { from: a, .. } | Self::Fetch { index: a, .. } => with(a),
            Self::Branch { condition: a, .. } | Self::Switch { value: a, .. } => with(a),
            Self::Binary { a, b, .. } | Self::Exchange { a, b, .. } => [a, b].into_iter().for_each(with),
            Self::Ternary { a, b, c, .. } => [a, b, c].into_iter().for_each(with),
            Self::Offset { base, index, .. } => base.iter_mut().chain([index]).for_each(with),
            Self::Load { place: from, .. } => place(from, with),
            Self::Store { place: to, from, .. } => {
                place(to, with);
                with(from);
            }
            Self::Atomic { place: to, value, comparator, .. } => {
                place(to, with);
                [value, comparator].into_iter().for_each(with);
            }
            Self::Length { .. } | Self::Barrier(_) | Self::Fence { .. } | Self::Jump(_) | Self::Return => {}
        }
    }
}
