//! Compiler statistics of every kernel on a device.

use super::{GroupBlend, KernelShape};
use crate::error::Result;
use crate::gpu::{Gpu, Statistic};
use crate::shaders::{self, ShaderDesc};
use rayon::prelude::*;

/// A kernel as compiled for one subgroup size.
#[derive(Clone, Debug)]
pub struct CompiledKernel {
    /// Name of the variant, such as `blend_forward_labels`.
    pub name: &'static str,
    /// Subgroup size.
    pub subgroup: u32,
    /// All statistics that the driver reports.
    pub statistics: Vec<Statistic>,
}

/// Names that drivers (Mesa's for AMD, Intel and NVIDIA, NVIDIA's) use for the same statistic.
pub const STATISTIC_NAMES: [(&str, &[&str]); 7] = [
    ("registers", &["VGPRs", "Register Count", "Max live registers", "Number of GPRs"]),
    ("spills", &["Spilled VGPRs", "Spilled SGPRs", "Spill Count", "Fill Count", "Local Memory Size", "SLM Size"]),
    ("shared B", &["LDS size", "Shared Memory Size", "Workgroup Memory Size"]),
    ("waves", &["Subgroups per SIMD"]),
    ("instructions", &["Instructions", "Instruction Count", "Instruction count"]),
    ("latency", &["Latency", "Cycle Count"]),
    ("cycles", &["Inverse Throughput"]),
];

impl CompiledKernel {
    /// Returns the sum of the statistics with these names; `None` if the driver reports none of them.
    pub fn figure(&self, names: &[&str]) -> Option<f64> {
        let values =
            self.statistics.iter().filter(|found| names.contains(&found.name.as_str())).map(|found| found.value);
        values.fold(None, |sum, value| Some(sum.unwrap_or(0.0) + value))
    }

    /// Returns the registers that were spilled to memory.
    pub fn spills(&self) -> f64 {
        STATISTIC_NAMES
            .iter()
            .find(|(name, _)| *name == "spills")
            .and_then(|(_, names)| self.figure(names))
            .unwrap_or(0.0)
    }
}

/// Compiles every variant of every kernel with default constants, for each subgroup size of the device and with
/// emulated subgroups. `gpu` must be opened for statistics.
pub fn compiled_kernels(gpu: &Gpu) -> Result<Vec<CompiledKernel>> {
    let (own, is_cpu) = (&gpu.capabilities().subgroup, gpu.is_cpu());
    let own_sizes = [8, 16, 32, 64].into_iter().filter(|size| !own.is_emulated && (own.min..=own.max).contains(size));
    let shapes = own_sizes.map(|size| KernelShape::new(size, is_cpu));
    let emulated = KernelShape { emulated: true, ..KernelShape::new(32, is_cpu) };
    let mut kernels = Vec::new();
    for shape in shapes.chain([emulated]) {
        let sweeping = shape.with_sweeps(gpu.capabilities()).filter(|_| !is_cpu);
        let shape = sweeping.unwrap_or(shape);
        let has_narrow = gpu.capabilities().has_narrow_storage();
        let of_shape = |shader: &&&'static ShaderDesc| {
            shader.macros.contains(&"EMULATED") == shape.emulated && (has_narrow || !shader.macros.contains(&"NARROW"))
        };
        for shader in shaders::ALL.iter().filter(of_shape) {
            let by_groups = shader.spec.iter().any(|constant| constant.name == "GROUP_LANES");
            let shape = if by_groups { shape.with_group_blend_of(GroupBlend::DEFAULT) } else { shape };
            let spec = shader.spec.iter().map(|constant| shape.constant(constant.name).unwrap_or(constant.default));
            let spec: Vec<u32> = spec.collect();
            kernels.push((*shader, spec, shape.subgroup));
        }
    }
    compiled(gpu, kernels)
}

/// Compiles kernels with these constants and subgroup sizes on all cores of the CPU. `gpu` must be opened for
/// statistics.
pub(crate) fn compiled(gpu: &Gpu, kernels: Vec<(&'static ShaderDesc, Vec<u32>, u32)>) -> Result<Vec<CompiledKernel>> {
    let mut kernels = kernels
        .into_par_iter()
        .map(|(shader, spec, subgroup)| {
            let statistics = gpu.statistics(shader, &spec, subgroup)?;
            Ok(CompiledKernel { name: shader.name, subgroup, statistics })
        })
        .collect::<Result<Vec<_>>>()?;
    kernels.sort_by_key(|kernel| (kernel.name, kernel.subgroup));
    Ok(kernels)
}
