//! Finds barriers that only some invocations of a workgroup may reach. Software devices run them as if all did; a GPU
//! hangs or goes on too early.

use rspirv::dr::{Block, Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, Op, StorageClass, Word};
use std::collections::{HashMap, HashSet};

/// Built-in values that differ within a workgroup.
const OWN_VALUES: [BuiltIn; 5] = [
    BuiltIn::LocalInvocationId,
    BuiltIn::LocalInvocationIndex,
    BuiltIn::GlobalInvocationId,
    BuiltIn::SubgroupLocalInvocationId,
    BuiltIn::SubgroupId,
];

/// Control flow of a function, and what may differ between the invocations of a workgroup. What all load from one place
/// counts as equal: a shader must not load what another invocation changes in the meantime.
struct Flow<'a> {
    blocks: &'a [Block],
    next: Vec<Vec<usize>>,
    /// By block: the blocks on every way from it to the end, a bit each.
    later: Vec<Vec<u64>>,
    /// The variable of each pointer to a part of one.
    bases: HashMap<Word, Word>,
    /// Variables that an invocation has alone.
    private: HashSet<Word>,
    /// Values, and private variables, that may differ.
    differing: HashSet<Word>,
    /// Blocks that may run for some invocations only.
    split: HashSet<usize>,
    /// Blocks where such ways meet.
    joins: HashSet<usize>,
}

/// Returns the number of barriers in a module, all of whose functions are inlined, that only some invocations of a
/// workgroup may reach.
pub fn split_barriers(module: &Module) -> usize {
    module.functions.iter().map(|function| Flow::new(module, &function.blocks).split_barriers()).sum()
}

impl<'a> Flow<'a> {
    fn new(module: &Module, blocks: &'a [Block]) -> Self {
        let place: HashMap<Word, usize> =
            blocks.iter().enumerate().filter_map(|(at, block)| Some((block.label_id()?, at))).collect();
        let targets = |block: &Block| {
            let last = block.instructions.last().map_or(&[][..], |last| &last.operands);
            last.iter().filter_map(|operand| place.get(&operand.id_ref_any()?).copied()).collect()
        };
        let next: Vec<Vec<usize>> = blocks.iter().map(targets).collect();
        let own = module.annotations.iter().filter_map(|note| match note.operands.as_slice() {
            [Operand::IdRef(id), Operand::Decoration(Decoration::BuiltIn), Operand::BuiltIn(value)]
                if OWN_VALUES.contains(value) =>
            {
                Some(*id)
            }
            _ => None,
        });
        let is_private = |value: &&Instruction| {
            let class = value.operands.first();
            value.class.opcode == Op::Variable
                && matches!(class, Some(Operand::StorageClass(StorageClass::Function | StorageClass::Private)))
        };
        let code = || blocks.iter().flat_map(|block| &block.instructions);
        let chains = code().filter(|chain| chain.class.opcode == Op::AccessChain);
        let base = |chain: &Instruction| Some((chain.result_id?, chain.operands.first()?.id_ref_any()?));
        Self {
            blocks,
            later: later(&next),
            next,
            bases: chains.filter_map(base).collect(),
            private: module
                .types_global_values
                .iter()
                .chain(code())
                .filter(is_private)
                .filter_map(|value| value.result_id)
                .collect(),
            differing: own.collect(),
            split: HashSet::new(),
            joins: HashSet::new(),
        }
    }

    fn split_barriers(mut self) -> usize {
        while self.spread() {}
        let is_barrier = |at: &Instruction| matches!(at.class.opcode, Op::ControlBarrier | Op::MemoryBarrier);
        self.split.iter().map(|&at| self.blocks[at].instructions.iter().filter(|at| is_barrier(at)).count()).sum()
    }

    /// Marks what differs because of what is known to differ. Returns whether anything is new.
    fn spread(&mut self) -> bool {
        let before = (self.differing.len(), self.split.len(), self.joins.len());
        for (at, block) in self.blocks.iter().enumerate() {
            for instruction in &block.instructions {
                if let Some(id) = self.differs(at, instruction) {
                    self.differing.insert(id);
                }
            }
            let Some(last) = block.instructions.last() else { continue };
            if self.next[at].len() > 1 && self.takes_differing(last) {
                self.divide(at);
            }
        }
        before != (self.differing.len(), self.split.len(), self.joins.len())
    }

    fn takes_differing(&self, instruction: &Instruction) -> bool {
        let mut ids = instruction.operands.iter().filter_map(Operand::id_ref_any);
        ids.any(|id| self.differing.contains(&id))
    }

    /// The value or variable that an instruction makes differ.
    fn differs(&self, block: usize, instruction: &Instruction) -> Option<Word> {
        let code = instruction.class.opcode;
        let name = instruction.class.opname;
        if code == Op::Store {
            let pointer = instruction.operands.first()?.id_ref_any()?;
            let to = self.bases.get(&pointer).copied().unwrap_or(pointer);
            let is_own = self.takes_differing(instruction) || self.split.contains(&block);
            return (self.private.contains(&to) && is_own).then_some(to);
        }
        let is_own = name.starts_with("Atomic")
            || name.starts_with("GroupNonUniform")
            || code == Op::Phi && self.joins.contains(&block)
            || self.takes_differing(instruction);
        instruction.result_id.filter(|_| is_own)
    }

    /// Marks the blocks between a branch that invocations take differently, and the block where all meet again.
    fn divide(&mut self, branch: usize) {
        let mut waiting = self.next[branch].clone();
        while let Some(at) = waiting.pop() {
            self.joins.insert(at);
            if self.later[branch][at / 64] >> (at % 64) & 1 == 0 && self.split.insert(at) {
                waiting.extend(&self.next[at]);
            }
        }
    }
}

/// By block: the blocks on every way from it to the end, without itself, a bit each.
fn later(next: &[Vec<usize>]) -> Vec<Vec<u64>> {
    let words = next.len().div_ceil(64);
    let mut later = vec![vec![u64::MAX; words]; next.len()];
    loop {
        let mut is_same = true;
        for at in (0..next.len()).rev() {
            let mut found = vec![if next[at].is_empty() { 0 } else { u64::MAX }; words];
            for &to in &next[at] {
                let own = |word: usize| if word == to / 64 { 1 << (to % 64) } else { 0 };
                found.iter_mut().enumerate().for_each(|(word, bits)| *bits &= later[to][word] | own(word));
            }
            is_same &= found == later[at];
            later[at] = found;
        }
        if is_same {
            return later;
        }
    }
}
