//! The constants of `glsl/include/constants.glsl` with the values that the GLSL compiler gives them.
//!
//! No expression is evaluated here: a probe shader stores each constant, and the value is read from its SPIR-V, so Rust
//! and the shaders cannot differ.

use super::Finding;
use super::compile::{GlslCompiler, Purpose};
use rspirv::dr::Operand;
use rspirv::spirv::{Op, Word};
use std::collections::HashMap;
use std::fmt::Write;

/// Name of the file with the constants.
pub const FILE_NAME: &str = "constants.glsl";

/// One constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// GLSL name.
    pub name: String,
    /// `float`, `uint` or `int`.
    pub glsl_type: String,
    /// The expression as written.
    pub expression: String,
    /// The comment after it, or the comment lines above it.
    pub doc: String,
    /// Bits of the value.
    pub bits: u32,
}

/// All constants of the text of `constants.glsl`.
pub fn read(compiler: &GlslCompiler, text: &str) -> Result<Vec<Constant>, Vec<Finding>> {
    let mut constants = declarations(text);
    if constants.is_empty() {
        return Ok(constants);
    }
    let place = format!("glsl/include/{FILE_NAME}");
    let fail = |rule: String| vec![Finding::new(place.clone(), rule)];
    let words = compiler.compile(&place, &probe(&constants), &[], Purpose::Reflect).map_err(fail)?;
    let stored = stored_constants(&words).map_err(fail)?;
    let mut findings = Vec::new();
    for (index, constant) in constants.iter_mut().enumerate() {
        match stored.get(index).copied().flatten() {
            Some(bits) => constant.bits = bits,
            None => findings.push(Finding::new(
                format!("{place}:{}", super::source::line_of(text, &constant.name)),
                format!(
                    "the value of `{}` is not known to the GLSL compiler; use literals and constants",
                    constant.name
                ),
            )),
        }
    }
    if findings.is_empty() { Ok(constants) } else { Err(findings) }
}

/// The lines `const TYPE NAME = EXPRESSION; // comment`.
fn declarations(text: &str) -> Vec<Constant> {
    let mut constants = Vec::new();
    let mut above: Vec<&str> = Vec::new();
    for line in text.lines().map(str::trim) {
        if let Some(comment) = line.strip_prefix("//") {
            above.push(comment.trim());
            continue;
        }
        if let Some(mut constant) = declaration(line) {
            if constant.doc.is_empty() {
                constant.doc = above.join(" ");
            }
            constants.push(constant);
        }
        above.clear();
    }
    constants
}

fn declaration(line: &str) -> Option<Constant> {
    let (glsl_type, rest) = line.strip_prefix("const ")?.trim_start().split_once(char::is_whitespace)?;
    let (name, rest) = rest.split_once('=')?;
    let (expression, comment) = rest.split_once(';')?;
    matches!(glsl_type, "float" | "uint" | "int").then(|| Constant {
        name: name.trim().to_owned(),
        glsl_type: glsl_type.to_owned(),
        expression: expression.trim().to_owned(),
        doc: comment.trim().trim_start_matches('/').trim().to_owned(),
        bits: 0,
    })
}

fn probe(constants: &[Constant]) -> String {
    let mut members = String::new();
    let mut stores = String::new();
    for (index, constant) in constants.iter().enumerate() {
        // Writing to a String does not fail.
        let _ = writeln!(members, "    {} probe_{index};", constant.glsl_type);
        let _ = writeln!(stores, "    probe_{index} = {};", constant.name);
    }
    format!(
        "#version 460\n#include \"{FILE_NAME}\"\nlayout(local_size_x = 1) in;\n\
         layout(std430, set = 0, binding = 0) buffer probe_block {{\n{members}}};\nvoid main() {{\n{stores}}}\n"
    )
}

/// Returns the bits of the stored constant for each store of the module in order, or `None` if it stores no constant.
fn stored_constants(words: &[u32]) -> Result<Vec<Option<u32>>, String> {
    let module = rspirv::dr::load_words(words).map_err(|error| error.to_string())?;
    let values: HashMap<Word, u32> = module
        .types_global_values
        .iter()
        .filter(|value| value.class.opcode == Op::Constant)
        .filter_map(|value| match (value.result_id, value.operands.first()) {
            (Some(id), Some(Operand::LiteralBit32(bits))) => Some((id, *bits)),
            _ => None,
        })
        .collect();
    let stores = module.functions.iter().flat_map(|function| function.all_inst_iter());
    Ok(stores
        .filter(|instruction| instruction.class.opcode == Op::Store)
        .map(|store| store.operands.get(1).and_then(Operand::id_ref_any).and_then(|id| values.get(&id).copied()))
        .collect())
}
