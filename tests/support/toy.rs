//! Shaders compiled by the test that uses them.

use crate::shaders::shadergen::tool::{interface, reflect};
use labelgs::shaders::{Access, BindingDesc, BindingKind, LocalSize, ShaderDesc, SpecDesc};

/// Compiles GLSL (without the version line) and describes its bindings: (name, access, kind, bytes of an element).
pub fn shader(name: &'static str, glsl: &str, bindings: &[(&'static str, Access, BindingKind, u32)]) -> ShaderDesc {
    let source = format!("#version 460\n#extension GL_KHR_shader_subgroup_basic : require\n{glsl}");
    let compiler = shaderc::Compiler::new().expect("shaderc starts");
    let mut options = shaderc::CompileOptions::new().expect("shaderc has options");
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    let compiled = compiler.compile_into_spirv(&source, shaderc::ShaderKind::Compute, name, "main", Some(&options));
    let compiled = compiled.unwrap_or_else(|error| panic!("{name}: {error}"));
    let bindings = bindings.iter().enumerate().map(|(binding, &(name, access, kind, element_bytes))| BindingDesc {
        name,
        binding: binding as u32,
        kind,
        access,
        element_bytes,
    });
    let module = rspirv::dr::load_words(compiled.as_binary()).expect("a module");
    let local_size = reflect::interface(&module).local_size.map(|size| match size {
        interface::LocalSize::Fixed(size) => LocalSize::Fixed(size),
        interface::LocalSize::Constant(id) => LocalSize::Constant(id),
    });
    ShaderDesc {
        stem: name,
        name,
        macros: &[],
        spirv: Box::leak(compiled.as_binary_u8().to_vec().into_boxed_slice()),
        bindings: Box::leak(bindings.collect::<Vec<_>>().into_boxed_slice()),
        spec: &[],
        local_size,
        uses_subgroups: glsl.contains("gl_Subgroup"),
    }
}

/// Adds specialisation constants (name, id, default), and leaks the description.
pub fn finish(mut shader: ShaderDesc, spec: &[(&'static str, u32, u32)]) -> &'static ShaderDesc {
    let spec = spec.iter().map(|&(name, id, default)| SpecDesc { name, id, is_pushed: false, default });
    shader.spec = Box::leak(spec.collect::<Vec<_>>().into_boxed_slice());
    Box::leak(Box::new(shader))
}
