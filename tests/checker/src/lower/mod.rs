//! Turns a SPIR-V module into a [`Program`].
//!
//! Covers what glslang makes of compute shaders with inlined functions. What is not covered is refused by name.

mod arithmetic;
mod constants;
mod function;
mod memory;
mod registers;
mod subgroups;
mod types;

use crate::program::{Program, module_hash};
use constants::Globals;
use rspirv::dr;
use std::collections::HashMap;

/// Says what is not supported, or is not valid.
pub type Result<T> = std::result::Result<T, String>;

/// Lowers the entry point of a module with the given values of specialisation constants.
pub fn lower(words: &[u32], specialised: &HashMap<u32, u32>) -> Result<Program> {
    let module = dr::load_words(words).map_err(|error| format!("the module cannot be read: {error}"))?;
    let globals = Globals::new(&module, specialised)?;
    let [function] = &module.functions[..] else { return Err("calls of functions".to_owned()) };
    let mut program = function::lower(&globals, function)?;
    program.local_size = globals.local_size(&module)?;
    program.hash = module_hash(words);
    registers::drop_dead(&mut program);
    registers::allocate(&mut program);
    Ok(program)
}

/// The id at a place of the operands.
fn id(operands: &[dr::Operand], at: usize) -> Result<u32> {
    operands.get(at).and_then(dr::Operand::id_ref_any).ok_or_else(|| format!("no id as operand {at}"))
}

/// The number at a place of the operands.
fn literal(operands: &[dr::Operand], at: usize) -> Result<u32> {
    match operands.get(at) {
        Some(dr::Operand::LiteralBit32(value) | dr::Operand::LiteralExtInstInteger(value)) => Ok(*value),
        other => Err(format!("{other:?} in place of a number")),
    }
}
