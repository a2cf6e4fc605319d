//! Wraps the shaderc crate in one type: GLSL text in, SPIR-V words out.

use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SourceLanguage, SpirvVersion,
    TargetEnv,
};
use std::path::{Path, PathBuf};

/// A macro of a variant: name and, if it has one, value.
pub type Define = (String, Option<String>);

/// Purpose of a compiled module.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Not optimised: keeps the names and the bindings that are declared but not used.
    Reflect,
    /// Optimised for speed: the words that ship.
    Ship,
}

/// Compiles shaders whose includes are in one folder.
pub struct GlslCompiler {
    compiler: Compiler,
    include: PathBuf,
}

impl GlslCompiler {
    /// A compiler that resolves `#include "name"` in `include`.
    pub fn new(include: &Path) -> Result<Self, String> {
        let compiler = Compiler::new().map_err(|error| format!("shaderc does not start: {error}"))?;
        Ok(Self { compiler, include: include.to_owned() })
    }

    /// SPIR-V words of a compute shader. Messages call the file `name`.
    pub fn compile(&self, name: &str, source: &str, defines: &[Define], purpose: Purpose) -> Result<Vec<u32>, String> {
        let mut options = CompileOptions::new().map_err(|error| error.to_string())?;
        options.set_source_language(SourceLanguage::GLSL);
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
        options.set_target_spirv(SpirvVersion::V1_5);
        options.set_warnings_as_errors();
        options.set_optimization_level(match purpose {
            Purpose::Reflect => OptimizationLevel::Zero,
            Purpose::Ship => OptimizationLevel::Performance,
        });
        for (define, value) in defines {
            options.add_macro_definition(define, value.as_deref());
        }
        let include = self.include.clone();
        options.set_include_callback(move |file, _kind, _from, _depth| read_include(&include, file));
        self.compiler
            .compile_into_spirv(source, ShaderKind::Compute, name, "main", Some(&options))
            .map(|artifact| artifact.as_binary().to_vec())
            .map_err(|error| error.to_string())
    }
}

fn read_include(folder: &Path, file: &str) -> Result<ResolvedInclude, String> {
    let path = folder.join(file);
    let content = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(ResolvedInclude { resolved_name: format!("glsl/include/{file}"), content })
}
