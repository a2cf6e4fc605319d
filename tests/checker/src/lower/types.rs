//! Types of a module, their words in registers and their layout in memory.

use super::{Result, id, literal};
use rspirv::dr;
use rspirv::spirv::{Decoration, Op, StorageClass};
use std::collections::HashMap;

/// Number that SPIR-V gives to a type, constant or value.
pub type Id = u32;

/// A type.
#[derive(Clone, Debug)]
pub enum Type {
    /// A bool, which is not stored.
    Bool,
    /// A number with these bits.
    Number(u32),
    /// Components or columns of the same type.
    Vector(Id, u32),
    /// Columns.
    Matrix(Id, u32),
    /// Elements.
    Array(Id, u32),
    /// Elements to the end of a buffer.
    Runtime(Id),
    /// Members.
    Struct(Vec<Id>),
    /// A pointer to a type in a storage class.
    Pointer(StorageClass, Id),
    /// A type without words: void, functions, images.
    Other,
}

/// A number in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leaf {
    /// Bytes from the start of the composite.
    pub offset: u32,
    /// Bytes of the number.
    pub width: u32,
}

/// All types, and the decorations that lay them out.
#[derive(Debug, Default)]
pub struct Types {
    types: HashMap<Id, Type>,
    offsets: HashMap<(Id, u32), u32>,
    array_strides: HashMap<Id, u32>,
    matrix_strides: HashMap<(Id, u32), u32>,
}

impl Types {
    /// Reads the decorations.
    pub fn new(annotations: &[dr::Instruction]) -> Result<Self> {
        let mut types = Self::default();
        for annotation in annotations {
            let operands = &annotation.operands;
            match (annotation.class.opcode, operands.get(1), operands.get(2)) {
                (Op::MemberDecorate, _, Some(dr::Operand::Decoration(kind))) => {
                    let member = (id(operands, 0)?, literal(operands, 1)?);
                    match kind {
                        Decoration::Offset => drop(types.offsets.insert(member, literal(operands, 3)?)),
                        Decoration::MatrixStride => drop(types.matrix_strides.insert(member, literal(operands, 3)?)),
                        Decoration::RowMajor => return Err("row-major matrices".to_owned()),
                        _ => {}
                    }
                }
                (Op::Decorate, Some(dr::Operand::Decoration(Decoration::ArrayStride)), _) => {
                    types.array_strides.insert(id(operands, 0)?, literal(operands, 2)?);
                }
                _ => {}
            }
        }
        Ok(types)
    }

    /// Adds a type, if the instruction declares one. `length` evaluates the constant of an array.
    pub fn declare(&mut self, from: &dr::Instruction, length: impl Fn(Id) -> Result<u32>) -> Result<bool> {
        let operands = &from.operands;
        let found = match from.class.opcode {
            Op::TypeBool => Type::Bool,
            Op::TypeInt | Op::TypeFloat => match literal(operands, 0)? {
                bits @ (16 | 32) => Type::Number(bits),
                bits => return Err(format!("numbers of {bits} bits")),
            },
            Op::TypeVector => Type::Vector(id(operands, 0)?, literal(operands, 1)?),
            Op::TypeMatrix => Type::Matrix(id(operands, 0)?, literal(operands, 1)?),
            Op::TypeArray => Type::Array(id(operands, 0)?, length(id(operands, 1)?)?),
            Op::TypeRuntimeArray => Type::Runtime(id(operands, 0)?),
            Op::TypeStruct => Type::Struct((0..operands.len()).map(|at| id(operands, at)).collect::<Result<_>>()?),
            Op::TypePointer => match operands.first() {
                Some(dr::Operand::StorageClass(class)) => Type::Pointer(*class, id(operands, 1)?),
                _ => return Err("a pointer without a storage class".to_owned()),
            },
            Op::TypeVoid | Op::TypeFunction | Op::TypeImage => Type::Other,
            _ => return Ok(false),
        };
        self.types.insert(from.result_id.unwrap_or_default(), found);
        Ok(true)
    }

    /// Returns a type.
    pub fn get(&self, id: Id) -> Result<&Type> {
        self.types.get(&id).ok_or_else(|| format!("type %{id}"))
    }

    /// Words of a value in registers.
    pub fn words(&self, id: Id) -> Result<u32> {
        Ok(match self.get(id)? {
            Type::Bool | Type::Number(_) => 1,
            Type::Vector(of, count) | Type::Matrix(of, count) | Type::Array(of, count) => count * self.words(*of)?,
            Type::Struct(members) => members.iter().map(|member| self.words(*member)).sum::<Result<u32>>()?,
            Type::Other => 0,
            Type::Runtime(_) | Type::Pointer(..) => return Err(format!("a value of type {:?}", self.get(id)?)),
        })
    }

    /// Type and first word of a part of a composite.
    pub fn part(&self, of: Id, index: u32) -> Result<(Id, u32)> {
        match self.get(of)? {
            Type::Vector(part, _) | Type::Matrix(part, _) | Type::Array(part, _) => {
                Ok((*part, index * self.words(*part)?))
            }
            Type::Struct(members) => {
                let before =
                    members.iter().take(index as usize).map(|member| self.words(*member)).sum::<Result<u32>>()?;
                Ok((*members.get(index as usize).ok_or("a member that is not there")?, before))
            }
            other => Err(format!("parts of {other:?}")),
        }
    }

    /// Bytes from one element or component to the next. `columns` is the stride of a matrix here.
    pub fn stride(&self, of: Id, columns: Option<u32>) -> Result<u32> {
        match self.get(of)? {
            Type::Vector(part, _) => Ok(self.width(*part)?),
            Type::Matrix(..) => columns.ok_or_else(|| "a matrix without a stride".to_owned()),
            Type::Array(..) | Type::Runtime(_) => {
                self.array_strides.get(&of).copied().ok_or_else(|| format!("array %{of} without a stride"))
            }
            other => Err(format!("elements of {other:?}")),
        }
    }

    /// Byte offset of a member, and the stride of matrices in it.
    pub fn member(&self, of: Id, member: u32) -> Result<(u32, Option<u32>)> {
        let offset = self.offsets.get(&(of, member)).copied().ok_or("a member without an offset")?;
        Ok((offset, self.matrix_strides.get(&(of, member)).copied()))
    }

    fn width(&self, of: Id) -> Result<u32> {
        match self.get(of)? {
            Type::Number(bits) => Ok(bits / 8),
            other => Err(format!("{other:?} in memory")),
        }
    }

    /// Numbers of a type in memory, in the order of its words in registers.
    pub fn leaves(&self, of: Id, columns: Option<u32>) -> Result<Vec<Leaf>> {
        let moved =
            |leaves: Vec<Leaf>, by: u32| leaves.into_iter().map(move |leaf| Leaf { offset: leaf.offset + by, ..leaf });
        match self.get(of)? {
            Type::Number(bits) => Ok(vec![Leaf { offset: 0, width: bits / 8 }]),
            Type::Vector(part, count) | Type::Matrix(part, count) | Type::Array(part, count) => {
                let (stride, part) = (self.stride(of, columns)?, self.leaves(*part, columns)?);
                Ok((0..*count).flat_map(|index| moved(part.clone(), index * stride)).collect())
            }
            Type::Struct(members) => {
                let mut all = Vec::new();
                for (index, member) in members.iter().enumerate() {
                    let (offset, columns) = self.member(of, index as u32)?;
                    all.extend(moved(self.leaves(*member, columns)?, offset));
                }
                Ok(all)
            }
            other => Err(format!("{other:?} in memory")),
        }
    }
}
