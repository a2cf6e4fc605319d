//! Compiles GLSL and runs it.

use labelgs_checker::findings::Kind;
use labelgs_checker::lower::lower;
use labelgs_checker::machine::{Bound, Dispatch, Memories};
use labelgs_checker::memory::Memory;
use labelgs_checker::program::Program;
use labelgs_checker::races::Races;
use std::collections::HashMap;

/// Compiles the body of a compute shader.
pub fn compile(glsl: &str, specialised: &[(u32, u32)]) -> Program {
    let extensions = ["basic", "arithmetic", "ballot", "shuffle", "vote"]
        .map(|name| format!("#extension GL_KHR_shader_subgroup_{name} : require\n"))
        .concat();
    let memory = "#extension GL_KHR_memory_scope_semantics : require\n#pragma use_storage_buffer\n";
    let source = format!("#version 460\n{extensions}{memory}{glsl}");
    let compiler = shaderc::Compiler::new().expect("shaderc starts");
    let mut options = shaderc::CompileOptions::new().expect("shaderc has options");
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    let compiled = compiler.compile_into_spirv(&source, shaderc::ShaderKind::Compute, "test", "main", Some(&options));
    let compiled = compiled.unwrap_or_else(|error| panic!("{error}"));
    let specialised: HashMap<u32, u32> = specialised.iter().copied().collect();
    lower(compiled.as_binary(), &specialised).unwrap_or_else(|error| panic!("{error}"))
}

/// Buffers of a run: words of each binding, by number. Buffers of `device` have no words that were written.
#[derive(Default)]
pub struct Buffers {
    /// Contents.
    pub words: Vec<Vec<u32>>,
    /// Those that the host does not see.
    pub device: Vec<usize>,
}

impl Buffers {
    /// Buffers of zeros, with these numbers of words.
    pub fn zeros(counts: &[usize]) -> Self {
        Self { words: counts.iter().map(|count| vec![0; *count]).collect(), device: Vec::new() }
    }

    /// Runs a program, keeps what it wrote, and returns the kinds of its findings.
    pub fn run(&mut self, program: &Program, groups: [u32; 3], lanes: u32, seed: u64) -> Vec<Kind> {
        let mut memories: Memories = Vec::new();
        for (place, words) in self.words.iter().enumerate() {
            let mut memory = Memory::new(words.len() as u64 * 4, !self.device.contains(&place));
            if !self.device.contains(&place) {
                words.iter().enumerate().for_each(|(word, value)| memory.set_word(word as u64 * 4, *value));
            }
            memories.push(Some(memory));
        }
        let bound = program.bindings.iter().map(|used| {
            let memory = used.number as usize;
            Bound { memory, offset: 0, bytes: self.words[memory].len() as u64 * 4, texels: None }
        });
        let bound = bound.collect();
        let dispatch = Dispatch { program, bound, push: &[], groups, lanes, seed };
        let findings = dispatch.run(&mut memories, &mut Races::default()).expect("a size of subgroups");
        for (words, memory) in self.words.iter_mut().zip(memories.iter().flatten()) {
            words.iter_mut().enumerate().for_each(|(word, value)| *value = memory.word(word as u64 * 4));
        }
        for finding in &findings {
            println!("{}", finding.text);
        }
        findings.into_iter().map(|finding| finding.kind).collect()
    }
}
