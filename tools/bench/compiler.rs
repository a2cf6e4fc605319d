//! Compiles kernels at benchmark run time with the build's compiler.

use crate::shadergen::compile::{Define, GlslCompiler, Purpose};
use crate::shadergen::{interface, reflect};
use labelgs::shaders::{Access, BindingDesc, BindingKind, LocalSize, ShaderDesc, SpecDesc};
use labelgs::{Error, Result};
use std::path::Path;

/// The engine's kernels.
pub const GLSL_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/glsl");

fn compiler() -> Result<GlslCompiler> {
    GlslCompiler::new(&Path::new(GLSL_FOLDER).join("include")).map_err(Error::Bug)
}

/// Returns the macros of a device that reads through texel buffers, or none.
pub fn texel_define(texel: bool) -> Vec<Define> {
    if texel { vec![("TEXEL".to_owned(), None)] } else { Vec::new() }
}

/// Compiles a kernel with the engine's includes to SPIR-V. The result lives as long as the program, because pipelines
/// are identified by the address of their module.
pub fn spirv(name: &str, source: &str, defines: &[Define]) -> Result<&'static [u8]> {
    let words = compiler()?.compile(name, source, defines, Purpose::Ship).map_err(Error::Check)?;
    Ok(words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>().leak())
}

/// A kernel of a benchmark with the interface that it declares.
pub fn shader(name: &'static str, source: &str, defines: &[Define]) -> Result<&'static ShaderDesc> {
    let declared = compiler()?.compile(name, source, defines, Purpose::Reflect).map_err(Error::Check)?;
    let declared = rspirv::dr::load_words(&declared).map_err(|error| Error::Bug(format!("{name}: {error}")))?;
    let found = reflect::interface(&declared);
    if let Some(problem) = found.problems.first() {
        return Err(Error::Check(format!("{name}: {}: {}", problem.name, problem.rule)));
    }
    let bindings = found.bindings.into_iter().map(|binding| BindingDesc {
        name: binding.name.leak(),
        binding: binding.binding,
        kind: match binding.kind {
            interface::Kind::Storage => BindingKind::Storage,
            interface::Kind::Texel => BindingKind::Texel,
        },
        access: match binding.access {
            interface::Access::Read => Access::Read,
            interface::Access::Write => Access::Write,
            interface::Access::ReadWrite => Access::ReadWrite,
        },
        element_bytes: binding.element_bytes,
    });
    let spec = found.spec.into_iter().map(|spec| SpecDesc {
        name: spec.name.leak(),
        id: spec.id,
        is_pushed: spec.is_pushed,
        default: spec.default,
    });
    Ok(Box::leak(Box::new(ShaderDesc {
        stem: name,
        name,
        macros: &[],
        spirv: spirv(name, source, defines)?,
        bindings: bindings.collect::<Vec<_>>().leak(),
        spec: spec.collect::<Vec<_>>().leak(),
        local_size: found.local_size.map(|size| match size {
            interface::LocalSize::Fixed(size) => LocalSize::Fixed(size),
            interface::LocalSize::Constant(id) => LocalSize::Constant(id),
        }),
        uses_subgroups: found.uses_subgroups,
    })))
}
