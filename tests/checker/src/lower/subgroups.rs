//! Operations of subgroups: one instruction for each component.

use super::Result;
use super::arithmetic::Words;
use super::function::Lowering;
use crate::ops::Binary;
use crate::program::{Exchange, Instruction, Source};
use rspirv::dr;
use rspirv::spirv::{GroupOperation, Op};

impl Lowering<'_> {
    /// Lowers an operation of subgroups. Returns `None` if it is of another kind.
    pub(super) fn exchange(&mut self, from: &dr::Instruction) -> Result<Option<Words>> {
        let operands = &from.operands;
        let combined = match from.class.opcode {
            Op::GroupNonUniformIAdd => Some((Binary::IAdd, 0)),
            Op::GroupNonUniformFAdd => Some((Binary::FAdd, 0)),
            Op::GroupNonUniformUMin => Some((Binary::UMin, u32::MAX)),
            Op::GroupNonUniformUMax => Some((Binary::UMax, 0)),
            Op::GroupNonUniformFMin => Some((Binary::FMin, f32::INFINITY.to_bits())),
            Op::GroupNonUniformFMax => Some((Binary::FMax, f32::NEG_INFINITY.to_bits())),
            Op::GroupNonUniformBitwiseAnd => Some((Binary::BitwiseAnd, u32::MAX)),
            Op::GroupNonUniformBitwiseOr => Some((Binary::BitwiseOr, 0)),
            _ => None,
        };
        if let Some((op, least)) = combined {
            let op = match operands.get(1) {
                Some(dr::Operand::GroupOperation(GroupOperation::Reduce)) => Exchange::Reduce(op),
                Some(dr::Operand::GroupOperation(GroupOperation::InclusiveScan)) => Exchange::InclusiveScan(op),
                Some(dr::Operand::GroupOperation(GroupOperation::ExclusiveScan)) => Exchange::ExclusiveScan(op, least),
                other => return Err(format!("the group operation {other:?}")),
            };
            let (a, b) = (self.value(operands, 2)?, self.constant(0));
            return Ok(Some(self.exchanges(op, &a, b)));
        }
        let zero = self.constant(0);
        Ok(Some(match from.class.opcode {
            Op::GroupNonUniformElect => self.exchanges(Exchange::Elect, &[zero], zero),
            Op::GroupNonUniformBallot => {
                let a = self.value(operands, 1)?[0];
                let half =
                    |first| self.new_word(|to| Instruction::Exchange { op: Exchange::Ballot(first), to, a, b: zero });
                let halves = [0, 32].map(half);
                vec![halves[0], halves[1], zero, zero]
            }
            Op::GroupNonUniformAll | Op::GroupNonUniformAny => {
                let a = self.value(operands, 1)?;
                let all = from.class.opcode == Op::GroupNonUniformAll;
                self.exchanges(if all { Exchange::All } else { Exchange::Any }, &a, zero)
            }
            Op::GroupNonUniformBroadcastFirst => {
                let a = self.value(operands, 1)?;
                self.exchanges(Exchange::BroadcastFirst, &a, zero)
            }
            Op::GroupNonUniformShuffle | Op::GroupNonUniformBroadcast | Op::GroupNonUniformShuffleXor => {
                let (a, b) = (self.value(operands, 1)?, self.value(operands, 2)?[0]);
                let xor = from.class.opcode == Op::GroupNonUniformShuffleXor;
                self.exchanges(if xor { Exchange::ShuffleXor } else { Exchange::Shuffle }, &a, b)
            }
            _ => return Ok(None),
        }))
    }

    fn exchanges(&mut self, op: Exchange, a: &[Source], b: Source) -> Words {
        a.iter().map(|&a| self.new_word(|to| Instruction::Exchange { op, to, a, b })).collect()
    }
}
