//! Arithmetic on values: one instruction for each component.

use super::function::Lowering;
use super::types::Type;
use super::{Result, id, literal};
use crate::ops::{Binary, Ternary, Unary};
use crate::program::{Instruction, Source};
use rspirv::dr;
use rspirv::spirv::{GlslStd450Op, Op};

/// Looks up operations of the same name.
macro_rules! same {
    ($op:expr, $from:ident to $kind:ident: $($name:ident)*) => {
        match $op { $($from::$name => Some($kind::$name),)* _ => None }
    };
}

/// The operation on one value.
pub fn unary(op: Op) -> Option<Unary> {
    same!(op, Op to Unary: FNegate SNegate Not LogicalNot BitCount BitReverse ConvertFToU ConvertFToS ConvertUToF
        ConvertSToF IsNan IsInf)
}

/// The operation on two values.
pub fn binary(op: Op) -> Option<Binary> {
    match op {
        Op::LogicalAnd => Some(Binary::BitwiseAnd),
        Op::LogicalOr => Some(Binary::BitwiseOr),
        _ => same!(op, Op to Binary: IAdd ISub IMul UDiv UMod SDiv SRem SMod FAdd FSub FMul FDiv FMod ShiftLeftLogical
            ShiftRightLogical ShiftRightArithmetic BitwiseAnd BitwiseOr BitwiseXor LogicalNotEqual LogicalEqual IEqual
            INotEqual ULessThan ULessThanEqual UGreaterThan UGreaterThanEqual SLessThan SLessThanEqual SGreaterThan
            SGreaterThanEqual FOrdEqual FOrdNotEqual FUnordNotEqual FOrdLessThan FOrdLessThanEqual FOrdGreaterThan
            FOrdGreaterThanEqual FUnordLessThan FUnordLessThanEqual FUnordGreaterThan FUnordGreaterThanEqual),
    }
}

fn ternary(op: Op) -> Option<Ternary> {
    same!(op, Op to Ternary: Select BitFieldUExtract BitFieldSExtract)
}

fn extended_unary(op: GlslStd450Op) -> Option<Unary> {
    same!(op, GlslStd450Op to Unary: FAbs SAbs FSign SSign Floor Ceil Trunc RoundEven Fract Sqrt InverseSqrt Exp Exp2 Log
        Log2 Sin Cos Tan Asin Acos Atan FindILsb FindUMsb FindSMsb)
}

fn extended_binary(op: GlslStd450Op) -> Option<Binary> {
    same!(op, GlslStd450Op to Binary: UMin UMax SMin SMax FMin FMax Step Pow Atan2)
}

fn extended_ternary(op: GlslStd450Op) -> Option<Ternary> {
    same!(op, GlslStd450Op to Ternary: Fma FClamp UClamp SClamp FMix)
}

/// A value: its words.
pub type Words = Vec<Source>;

impl Lowering<'_> {
    fn unary(&mut self, op: Unary, a: &[Source]) -> Words {
        a.iter().map(|&a| self.new_word(|to| Instruction::Unary { op, to, a })).collect()
    }

    pub(super) fn one(&mut self, op: Binary, a: Source, b: Source) -> Source {
        self.new_word(|to| Instruction::Binary { op, to, a, b })
    }

    fn binary(&mut self, op: Binary, a: &[Source], b: &[Source]) -> Words {
        a.iter().zip(b).map(|(&a, &b)| self.one(op, a, b)).collect()
    }

    fn ternary(&mut self, op: Ternary, [a, b, c]: [&[Source]; 3]) -> Words {
        // The condition of a select may be one bool for a whole vector.
        let first = |place: usize| a.get(place).copied().unwrap_or(a[0]);
        (0..b.len())
            .map(|word| {
                let (a, b, c) = (first(word), b[word], c[word]);
                self.new_word(|to| Instruction::Ternary { op, to, a, b, c })
            })
            .collect()
    }

    /// Products, summed from the first to the last.
    fn dot(&mut self, a: &[Source], b: &[Source]) -> Source {
        let products = self.binary(Binary::FMul, a, b);
        self.fold(Binary::FAdd, &products)
    }

    fn fold(&mut self, op: Binary, words: &[Source]) -> Source {
        words[1..].iter().fold(words[0], |sum, word| self.one(op, sum, *word))
    }

    /// Lowers an instruction that only computes. Returns `None` if it is of another kind.
    pub(super) fn arithmetic(&mut self, from: &dr::Instruction) -> Result<Option<Words>> {
        let (op, operands) = (from.class.opcode, &from.operands);
        if op == Op::ExtInst {
            return self.extended(operands).map(Some);
        }
        if let Some(op) = unary(op) {
            let a = self.value(operands, 0)?;
            return Ok(Some(self.unary(op, &a)));
        }
        if let Some(op) = binary(op) {
            let (a, b) = (self.value(operands, 0)?, self.value(operands, 1)?);
            return Ok(Some(self.binary(op, &a, &b)));
        }
        if let Some(op) = ternary(op) {
            let (a, b, c) = (self.value(operands, 0)?, self.value(operands, 1)?, self.value(operands, 2)?);
            // The field's place and length are one number for a whole vector.
            let wide = |words: Words| if words.len() < a.len() { vec![words[0]; a.len()] } else { words };
            let (b, c) = (wide(b), wide(c));
            return Ok(Some(self.ternary(op, [&a, &b, &c])));
        }
        self.composite(from)
    }

    /// Lowers what moves words about, and what sums over vectors.
    fn composite(&mut self, from: &dr::Instruction) -> Result<Option<Words>> {
        let operands = &from.operands;
        let of = from.result_type.unwrap_or_default();
        Ok(Some(match from.class.opcode {
            Op::Bitcast | Op::CopyObject | Op::CopyLogical => self.value(operands, 0)?,
            Op::UConvert => {
                let a = self.value(operands, 0)?;
                let narrows = matches!(self.globals.types.get(of)?, Type::Number(16));
                if narrows { self.unary(Unary::Low16, &a) } else { a }
            }
            Op::Undef => vec![self.constant(0); self.globals.types.words(of)? as usize],
            Op::CompositeConstruct => {
                (0..operands.len()).map(|at| self.value(operands, at)).collect::<Result<Vec<_>>>()?.concat()
            }
            Op::CompositeExtract => {
                let (first, count) = self.part(self.type_of(id(operands, 0)?)?, &operands[1..])?;
                self.value(operands, 0)?[first..first + count].to_vec()
            }
            Op::CompositeInsert => {
                let (part, mut whole) = (self.value(operands, 0)?, self.value(operands, 1)?);
                let (first, count) = self.part(of, &operands[2..])?;
                whole[first..first + count].copy_from_slice(&part);
                whole
            }
            Op::VectorShuffle => {
                let both = [self.value(operands, 0)?, self.value(operands, 1)?].concat();
                let pick = |at| Ok(both.get(literal(operands, at)? as usize).copied().unwrap_or(both[0]));
                (2..operands.len()).map(pick).collect::<Result<_>>()?
            }
            Op::VectorExtractDynamic => {
                let (vector, index) = (self.value(operands, 0)?, self.value(operands, 1)?[0]);
                let mut found = vector[0];
                for (place, &word) in vector.iter().enumerate().skip(1) {
                    let place = self.constant(place as u32);
                    let here = self.one(Binary::IEqual, index, place);
                    found = self.ternary(Ternary::Select, [&[here], &[word], &[found]])[0];
                }
                vec![found]
            }
            Op::All | Op::Any => {
                let a = self.value(operands, 0)?;
                let both = from.class.opcode == Op::All;
                vec![self.fold(if both { Binary::BitwiseAnd } else { Binary::BitwiseOr }, &a)]
            }
            _ => return self.product(from),
        }))
    }

    /// Lowers products of vectors and matrices.
    fn product(&mut self, from: &dr::Instruction) -> Result<Option<Words>> {
        let operands = &from.operands;
        Ok(Some(match from.class.opcode {
            Op::Dot => {
                let (a, b) = (self.value(operands, 0)?, self.value(operands, 1)?);
                vec![self.dot(&a, &b)]
            }
            Op::VectorTimesScalar | Op::MatrixTimesScalar => {
                let (a, b) = (self.value(operands, 0)?, self.value(operands, 1)?[0]);
                self.binary(Binary::FMul, &a, &vec![b; a.len()])
            }
            Op::VectorTimesMatrix => {
                let (vector, matrix) = (self.value(operands, 0)?, self.value(operands, 1)?);
                matrix.chunks(vector.len()).map(|column| self.dot(&vector, column)).collect()
            }
            Op::MatrixTimesVector => {
                let (matrix, vector) = (self.value(operands, 0)?, self.value(operands, 1)?);
                self.transform(&matrix, &vector)
            }
            Op::MatrixTimesMatrix => {
                let (a, b) = (self.value(operands, 0)?, self.value(operands, 1)?);
                let columns = self.columns(id(operands, 0)?)?;
                b.chunks(columns).flat_map(|column| self.transform(&a, column)).collect()
            }
            Op::Transpose => {
                let a = self.value(operands, 0)?;
                let rows = a.len() / self.columns(id(operands, 0)?)?;
                (0..rows).flat_map(|row| a.iter().skip(row).step_by(rows).copied().collect::<Vec<_>>()).collect()
            }
            _ => return Ok(None),
        }))
    }

    fn columns(&self, matrix: u32) -> Result<usize> {
        match self.globals.types.get(self.type_of(matrix)?)? {
            Type::Matrix(_, columns) => Ok(*columns as usize),
            other => Err(format!("columns of {other:?}")),
        }
    }

    fn transform(&mut self, matrix: &[Source], vector: &[Source]) -> Words {
        let rows = matrix.len() / vector.len();
        (0..rows)
            .map(|row| {
                let across = matrix.iter().skip(row).step_by(rows).copied().collect::<Vec<_>>();
                self.dot(&across, vector)
            })
            .collect()
    }

    /// First word and words of a part that literal indices name.
    fn part(&self, of: u32, indices: &[dr::Operand]) -> Result<(usize, usize)> {
        let (mut of, mut first) = (of, 0);
        for at in 0..indices.len() {
            let (part, before) = self.globals.types.part(of, literal(indices, at)?)?;
            (of, first) = (part, first + before);
        }
        Ok((first as usize, self.globals.types.words(of)? as usize))
    }

    /// Lowers an instruction of GLSL.std.450.
    fn extended(&mut self, operands: &[dr::Operand]) -> Result<Words> {
        let number = literal(operands, 1)?;
        let op = GlslStd450Op::from_u32(number).ok_or_else(|| format!("instruction {number} of GLSL.std.450"))?;
        let a = self.value(operands, 2)?;
        if let Some(op) = extended_unary(op) {
            return Ok(self.unary(op, &a));
        }
        if let Some(op) = extended_binary(op) {
            let b = self.value(operands, 3)?;
            return Ok(self.binary(op, &a, &b));
        }
        if let Some(op) = extended_ternary(op) {
            let (b, c) = (self.value(operands, 3)?, self.value(operands, 4)?);
            return Ok(self.ternary(op, [&a, &b, &c]));
        }
        match op {
            GlslStd450Op::UnpackUnorm4x8 => {
                let bytes = [0, 1, 2, 3].map(|byte| self.constant(byte));
                Ok(bytes.map(|byte| self.one(Binary::UnpackUnorm8, a[0], byte)).to_vec())
            }
            GlslStd450Op::Length => {
                let square = self.dot(&a, &a);
                Ok(self.unary(Unary::Sqrt, &[square]))
            }
            GlslStd450Op::Distance => {
                let b = self.value(operands, 3)?;
                let between = self.binary(Binary::FSub, &a, &b);
                let square = self.dot(&between, &between);
                Ok(self.unary(Unary::Sqrt, &[square]))
            }
            GlslStd450Op::Normalize => {
                let square = self.dot(&a, &a);
                let length = self.unary(Unary::Sqrt, &[square])[0];
                Ok(self.binary(Binary::FDiv, &a, &vec![length; a.len()]))
            }
            GlslStd450Op::Cross => {
                let b = self.value(operands, 3)?;
                Ok(self.cross(&a, &b))
            }
            GlslStd450Op::MatrixInverse if a.len() == 9 => {
                // The rows of the inverse are cross products of columns, divided by the determinant.
                let rows = [(3, 6), (6, 0), (0, 3)].map(|(b, c)| self.cross(&a[b..b + 3], &a[c..c + 3]));
                let determinant = self.dot(&a[..3], &rows[0]);
                let adjugate = (0..9).map(|place| rows[place % 3][place / 3]).collect::<Vec<_>>();
                Ok(self.binary(Binary::FDiv, &adjugate, &[determinant; 9]))
            }
            other => Err(format!("{other:?} of GLSL.std.450")),
        }
    }

    fn cross(&mut self, a: &[Source], b: &[Source]) -> Words {
        [(1, 2), (2, 0), (0, 1)]
            .map(|(x, y)| {
                let (left, right) = (self.one(Binary::FMul, a[x], b[y]), self.one(Binary::FMul, a[y], b[x]));
                self.one(Binary::FSub, left, right)
            })
            .to_vec()
    }
}
