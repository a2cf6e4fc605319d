//! Types, constants and variables of a module, with specialisation.

use super::arithmetic;
use super::types::{Id, Type, Types};
use super::{Result, id, literal};
use crate::program::Builtin;
use rspirv::dr;
use rspirv::spirv::{BuiltIn, Decoration, ExecutionMode, Op, StorageClass};
use std::collections::{HashMap, HashSet};

/// A variable outside of the function.
#[derive(Clone, Copy, Debug)]
pub struct Variable {
    /// Its number.
    pub id: Id,
    /// Where it is.
    pub class: StorageClass,
    /// What it holds.
    pub of: Id,
    /// Binding of a buffer.
    pub binding: Option<u32>,
    /// Built-in value.
    pub builtin: Option<Builtin>,
    /// True for `coherent` and `volatile` buffers.
    pub is_coherent: bool,
}

/// All that a function refers to.
#[derive(Debug, Default)]
pub struct Globals {
    /// Types.
    pub types: Types,
    /// Words of each constant.
    pub constants: HashMap<Id, Vec<u32>>,
    /// Variables.
    pub variables: Vec<Variable>,
    workgroup_size: Option<Id>,
}

/// Decorations of variables and constants.
#[derive(Default)]
struct Decorations {
    bindings: HashMap<Id, u32>,
    builtins: HashMap<Id, BuiltIn>,
    specs: HashMap<Id, u32>,
    coherent: HashSet<Id>,
}

impl Globals {
    /// Reads a module. `specialised` has values of specialisation constants by their ids in GLSL.
    pub fn new(module: &dr::Module, specialised: &HashMap<u32, u32>) -> Result<Self> {
        let decorations = Decorations::new(&module.annotations)?;
        let size = decorations.builtins.iter().find(|(_, builtin)| **builtin == BuiltIn::WorkgroupSize);
        let mut globals = Self {
            types: Types::new(&module.annotations)?,
            workgroup_size: size.map(|(id, _)| *id),
            ..Self::default()
        };
        for instruction in &module.types_global_values {
            globals.declare(instruction, &decorations, specialised)?;
        }
        Ok(globals)
    }

    fn declare(&mut self, from: &dr::Instruction, found: &Decorations, specialised: &HashMap<u32, u32>) -> Result<()> {
        let constants = &self.constants;
        let length = |id: Id| constants.get(&id).map(|words| words[0]).ok_or_else(|| "an array's length".to_owned());
        if self.types.declare(from, length)? {
            return Ok(());
        }
        let (id, of) = (from.result_id.unwrap_or_default(), from.result_type.unwrap_or_default());
        let given = found.specs.get(&id).and_then(|spec| specialised.get(spec)).copied();
        let words = match from.class.opcode {
            Op::ConstantTrue | Op::SpecConstantTrue => vec![given.unwrap_or(1)],
            Op::ConstantFalse | Op::SpecConstantFalse => vec![given.unwrap_or(0)],
            Op::Constant | Op::SpecConstant => vec![given.map_or_else(|| literal(&from.operands, 0), Ok)?],
            Op::ConstantNull | Op::Undef => vec![0; self.types.words(of)? as usize],
            Op::ConstantComposite | Op::SpecConstantComposite => self.parts(&from.operands)?.concat(),
            Op::SpecConstantOp => {
                let Some(dr::Operand::LiteralSpecConstantOpInteger(op)) = from.operands.first() else {
                    return Err("a constant without an operation".to_owned());
                };
                self.evaluate(*op, &from.operands[1..])?
            }
            Op::Variable => {
                self.variables.push(self.variable(from, found)?);
                return Ok(());
            }
            other => return Err(format!("Op{other:?} outside of a function")),
        };
        self.constants.insert(id, words);
        Ok(())
    }

    fn parts(&self, operands: &[dr::Operand]) -> Result<Vec<Vec<u32>>> {
        let part = |at| self.constants.get(&id(operands, at)?).cloned().ok_or_else(|| "a constant's part".to_owned());
        (0..operands.len()).map(part).collect()
    }

    /// Value of an operation on constants.
    fn evaluate(&self, op: Op, operands: &[dr::Operand]) -> Result<Vec<u32>> {
        if op == Op::CompositeExtract {
            let place = literal(operands, 1)? as usize;
            return Ok(vec![*self.parts(&operands[..1])?[0].get(place).ok_or("a component that is not there")?]);
        }
        let parts = self.parts(operands)?;
        let at = |part: &Vec<u32>, word: usize| part.get(word).copied().unwrap_or(part[0]);
        (0..parts.iter().map(Vec::len).max().unwrap_or(0))
            .map(|word| match (&parts[..], arithmetic::unary(op), arithmetic::binary(op)) {
                ([a], Some(op), _) => Ok(op.one([at(a, word)])),
                ([a, b], _, Some(op)) => Ok(op.one([at(a, word), at(b, word)])),
                ([a, b, c], _, _) if op == Op::Select => Ok(if at(a, word) != 0 { at(b, word) } else { at(c, word) }),
                _ => Err(format!("Op{op:?} of constants")),
            })
            .collect()
    }

    fn variable(&self, from: &dr::Instruction, found: &Decorations) -> Result<Variable> {
        let id = from.result_id.unwrap_or_default();
        let Type::Pointer(class, of) = *self.types.get(from.result_type.unwrap_or_default())? else {
            return Err("a variable that is no pointer".to_owned());
        };
        let builtin = found.builtins.get(&id).map(|builtin| named(*builtin)).transpose()?;
        let is_coherent = found.coherent.contains(&id) || found.coherent.contains(&of);
        Ok(Variable { id, class, of, binding: found.bindings.get(&id).copied(), builtin, is_coherent })
    }

    /// Invocations of a workgroup.
    pub fn local_size(&self, module: &dr::Module) -> Result<[u32; 3]> {
        let built_in = self.workgroup_size.and_then(|id| self.constants.get(&id));
        if let Some([x, y, z]) = built_in.map(Vec::as_slice) {
            return Ok([*x, *y, *z]);
        }
        for mode in &module.execution_modes {
            let operands = &mode.operands;
            match operands.get(1) {
                Some(dr::Operand::ExecutionMode(ExecutionMode::LocalSize)) => {
                    return Ok([literal(operands, 2)?, literal(operands, 3)?, literal(operands, 4)?]);
                }
                Some(dr::Operand::ExecutionMode(ExecutionMode::LocalSizeId)) => {
                    let parts = self.parts(&operands[2..5])?.concat();
                    return Ok([parts[0], parts[1], parts[2]]);
                }
                _ => {}
            }
        }
        Err("a shader without a workgroup size".to_owned())
    }
}

impl Decorations {
    fn new(annotations: &[dr::Instruction]) -> Result<Self> {
        let mut found = Self::default();
        for annotation in annotations {
            let operands = &annotation.operands;
            let (member, at) = match annotation.class.opcode {
                Op::Decorate => (false, 1),
                Op::MemberDecorate => (true, 2),
                _ => continue,
            };
            let Some(dr::Operand::Decoration(kind)) = operands.get(at) else { continue };
            let target = id(operands, 0)?;
            match (kind, operands.get(at + 1)) {
                (Decoration::Binding, _) if !member => drop(found.bindings.insert(target, literal(operands, 2)?)),
                (Decoration::SpecId, _) => drop(found.specs.insert(target, literal(operands, 2)?)),
                (Decoration::BuiltIn, Some(dr::Operand::BuiltIn(builtin))) if !member => {
                    found.builtins.insert(target, *builtin);
                }
                // Of a block, the decoration is on its members; blocks have one member or none is.
                (Decoration::Coherent | Decoration::Volatile, _) => drop(found.coherent.insert(target)),
                _ => {}
            }
        }
        Ok(found)
    }
}

fn named(builtin: BuiltIn) -> Result<Builtin> {
    Ok(match builtin {
        BuiltIn::NumWorkgroups => Builtin::NumWorkgroups,
        BuiltIn::WorkgroupId => Builtin::WorkgroupId,
        BuiltIn::LocalInvocationId => Builtin::LocalInvocationId,
        BuiltIn::LocalInvocationIndex => Builtin::LocalInvocationIndex,
        BuiltIn::GlobalInvocationId => Builtin::GlobalInvocationId,
        BuiltIn::SubgroupId => Builtin::SubgroupId,
        BuiltIn::SubgroupLocalInvocationId => Builtin::SubgroupLocalInvocationId,
        BuiltIn::SubgroupSize => Builtin::SubgroupSize,
        BuiltIn::NumSubgroups => Builtin::NumSubgroups,
        other => return Err(format!("the built-in value {other:?}")),
    })
}
