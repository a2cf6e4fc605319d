//! Pointers, loads, stores and atomics.

use super::arithmetic::Words;
use super::function::Lowering;
use super::types::{Id, Leaf, Type};
use super::{Result, id};
use crate::ops::Binary;
use crate::program::{Atomic, Instruction, Place, Semantics, Source, Space};
use rspirv::dr;
use rspirv::spirv::Op;

/// A pointer: where it points, and to what.
#[derive(Clone, Copy, Debug)]
pub struct Pointer {
    /// The place.
    pub place: Place,
    /// The type there.
    pub of: Id,
    /// Bytes between columns of matrices there.
    pub columns: Option<u32>,
}

impl Pointer {
    /// Points to the start of a variable.
    pub fn new(space: Space, of: Id) -> Self {
        Self { place: Place { space, plus: 0, at: None }, of, columns: None }
    }

    /// True if offsets are bytes, and words otherwise.
    fn counts_bytes(&self) -> bool {
        matches!(self.place.space, Space::Buffer(_) | Space::Push)
    }
}

impl Lowering<'_> {
    pub(super) fn pointer(&self, operands: &[dr::Operand], at: usize) -> Result<Pointer> {
        let id = id(operands, at)?;
        self.pointers.get(&id).copied().ok_or_else(|| format!("%{id} as a pointer"))
    }

    /// The part of a composite in memory that indices name.
    pub(super) fn access_chain(&mut self, operands: &[dr::Operand]) -> Result<Pointer> {
        let mut to = self.pointer(operands, 0)?;
        for at in 1..operands.len() {
            let index = self.value(operands, at)?[0];
            let fixed = self.known(index);
            let types = &self.globals.types;
            let (part, bound) = match types.get(to.of)? {
                Type::Struct(members) => {
                    let member = fixed.ok_or("a member by a computed index")?;
                    let part = *members.get(member as usize).ok_or("a member that is not there")?;
                    if to.counts_bytes() {
                        let (offset, columns) = types.member(to.of, member)?;
                        (to.place.plus, to.columns) = (to.place.plus + offset, columns);
                    } else {
                        to.place.plus += types.part(to.of, member)?.1;
                    }
                    to.of = part;
                    continue;
                }
                Type::Vector(part, count) | Type::Matrix(part, count) | Type::Array(part, count) => (*part, *count),
                Type::Runtime(part) => (*part, u32::MAX),
                other => return Err(format!("an index into {other:?}")),
            };
            let stride = if to.counts_bytes() { types.stride(to.of, to.columns)? } else { types.words(part)? };
            match fixed {
                Some(index) if index < bound => to.place.plus += index * stride,
                _ => {
                    let base = to.place.at;
                    let place = self.new_word(|to| Instruction::Offset { to, base, index, stride, bound });
                    to.place.at = Some(place);
                }
            }
            to.of = part;
        }
        Ok(to)
    }

    /// Numbers of what a pointer points to.
    fn leaves(&self, from: &Pointer) -> Result<Vec<Leaf>> {
        if from.counts_bytes() {
            return self.globals.types.leaves(from.of, from.columns);
        }
        Ok((0..self.globals.types.words(from.of)?).map(|offset| Leaf { offset, width: 4 }).collect())
    }

    pub(super) fn load(&mut self, from: &Pointer) -> Result<Words> {
        let leaves = self.leaves(from)?;
        Ok(leaves
            .into_iter()
            .map(|leaf| match from.place {
                Place { space: Space::Local(first), plus, at: None } => {
                    let from = Source(first + plus + leaf.offset);
                    self.new_word(|to| Instruction::Move { to, from })
                }
                place => {
                    let place = Place { plus: place.plus + leaf.offset, ..place };
                    self.new_word(|to| Instruction::Load { to, place, width: leaf.width })
                }
            })
            .collect())
    }

    pub(super) fn store(&mut self, to: &Pointer, words: &[Source]) -> Result<()> {
        self.mark_written(to);
        for (leaf, &from) in self.leaves(to)?.into_iter().zip(words) {
            self.emit(match to.place {
                Place { space: Space::Local(first), plus, at: None } => {
                    Instruction::Move { to: first + plus + leaf.offset, from }
                }
                place => {
                    let place = Place { plus: place.plus + leaf.offset, ..place };
                    Instruction::Store { place, from, width: leaf.width }
                }
            });
        }
        Ok(())
    }

    fn mark_written(&mut self, to: &Pointer) {
        if let Space::Buffer(place) = to.place.space {
            self.program.bindings[usize::from(place)].is_written = true;
        }
    }

    /// Lowers an atomic instruction. Returns `None` if it is of another kind.
    pub(super) fn atomic(&mut self, from: &dr::Instruction) -> Result<Option<Words>> {
        let operands = &from.operands;
        let atomic = match from.class.opcode {
            Op::AtomicIAdd | Op::AtomicIIncrement => Atomic::Binary(Binary::IAdd),
            Op::AtomicISub | Op::AtomicIDecrement => Atomic::Binary(Binary::ISub),
            Op::AtomicUMin => Atomic::Binary(Binary::UMin),
            Op::AtomicUMax => Atomic::Binary(Binary::UMax),
            Op::AtomicSMin => Atomic::Binary(Binary::SMin),
            Op::AtomicSMax => Atomic::Binary(Binary::SMax),
            Op::AtomicAnd => Atomic::Binary(Binary::BitwiseAnd),
            Op::AtomicOr => Atomic::Binary(Binary::BitwiseOr),
            Op::AtomicXor => Atomic::Binary(Binary::BitwiseXor),
            Op::AtomicExchange => Atomic::Exchange,
            Op::AtomicCompareExchange => Atomic::CompareExchange,
            Op::AtomicLoad => Atomic::Load,
            Op::AtomicStore => Atomic::Store,
            _ => return Ok(None),
        };
        let pointer = self.pointer(operands, 0)?;
        let semantics = self.semantics(operands, 1)?;
        let (value, comparator) = match (atomic, from.class.opcode) {
            (Atomic::Load, _) => (self.constant(0), self.constant(0)),
            (_, Op::AtomicIIncrement | Op::AtomicIDecrement) => (self.constant(1), self.constant(0)),
            (Atomic::CompareExchange, _) => (self.value(operands, 4)?[0], self.value(operands, 5)?[0]),
            _ => (self.value(operands, 3)?[0], self.constant(0)),
        };
        if atomic != Atomic::Load {
            self.mark_written(&pointer);
        }
        // Release is a fence before, acquire one after.
        let fence = Instruction::Fence { semantics, is_part: true };
        if semantics.bits & 0x1c != 0 {
            self.emit(fence.clone());
        }
        let place = pointer.place;
        let word = self.new_word(|to| Instruction::Atomic { op: atomic, to, place, value, comparator });
        if semantics.bits & 0x1a != 0 {
            self.emit(fence);
        }
        Ok(Some(vec![word]))
    }

    /// Scope and semantics of memory, as successive operands.
    pub(super) fn semantics(&self, operands: &[dr::Operand], at: usize) -> Result<Semantics> {
        let constant =
            |at| self.value(operands, at).ok().and_then(|words| self.known(words[0])).ok_or("a computed scope");
        Ok(Semantics { scope: constant(at)?, bits: constant(at + 1)? })
    }
}
