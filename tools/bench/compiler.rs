//! Kernels of benchmarks, compiled when they run.

use labelgs::{Error, Result};
use shaderc::{CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, TargetEnv};

/// Includes of the engine that the kernels share.
const INCLUDES: [(&str, &str); 6] = [
    ("layout.glsl", include_str!("../../glsl/include/layout.glsl")),
    ("constants.glsl", include_str!("../../glsl/include/constants.glsl")),
    ("step.glsl", include_str!("../../glsl/include/step.glsl")),
    ("dispatch.glsl", include_str!("../../glsl/include/dispatch.glsl")),
    ("blend_tile.glsl", include_str!("../../glsl/include/blend_tile.glsl")),
    ("subgroup.glsl", include_str!("../../glsl/include/subgroup.glsl")),
];

/// SPIR-V of a kernel, with the engine's includes; it lives as long as the program, as that of the engine's shaders does.
pub fn spirv(name: &str, source: &str, texel: bool) -> Result<&'static [u8]> {
    let failed = |error: shaderc::Error| Error::Bug(format!("{name}: {error}"));
    let compiler = Compiler::new().map_err(failed)?;
    let mut options = CompileOptions::new().map_err(failed)?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(OptimizationLevel::Performance);
    if texel {
        options.add_macro_definition("TEXEL", None);
    }
    options.set_include_callback(|file, _kind, _from, _depth| {
        let found = INCLUDES.iter().find(|(name, _)| *name == file);
        let (name, content) = found.ok_or_else(|| format!("there is no {file}"))?;
        Ok(ResolvedInclude { resolved_name: (*name).to_owned(), content: (*content).to_owned() })
    });
    let words = compiler.compile_into_spirv(source, ShaderKind::Compute, name, "main", Some(&options));
    Ok(Box::leak(words.map_err(failed)?.as_binary_u8().to_vec().into_boxed_slice()))
}
