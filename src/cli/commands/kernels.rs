//! `labelgs kernels`: what the driver's compiler makes of every kernel.

use crate::cli::support::Context;
use crate::engine::{Engine, EngineSize, LabelSize, capacity};
use crate::gpu::{Gpu, GpuOptions};
use crate::pass::{
    CompiledKernel, KernelShape, STATISTIC_NAMES, Supervision, Variant, compiled, compiled_kernels, training_step,
};
use crate::scheduler::plan::PassDecl;
use crate::{Error, Result};
use clap::Args;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// `labelgs kernels`.
#[derive(Args, Clone, Debug)]
pub struct KernelsArgs {
    /// Only the kernels of a training with labels, in the form that this device runs.
    #[arg(long)]
    pub used: bool,
}

/// Prints the table. Fails if a kernel spills registers.
pub(crate) fn run(args: &KernelsArgs, context: &Context) -> Result<()> {
    let gpu = Gpu::new(&GpuOptions { statistics: true, ..context.gpu_options()? })?;
    context.listen(&gpu);
    let (found, kernels) = (gpu.capabilities(), if args.used { used_kernels(&gpu)? } else { compiled_kernels(&gpu)? });
    let result = json!({
        "schema_version": 1,
        "device": found.name,
        "driver": { "name": found.driver_name, "version": found.driver_info },
        "kernels": kernels_json(&kernels),
    });
    let title = format!("{} ({} {})\n", found.name, found.driver_name, found.driver_info);
    context.show(&result, &(title + &to_text(&kernels)))?;
    let spilled = kernels.iter().filter(|kernel| kernel.spills() > 0.0);
    let spilled: Vec<String> = spilled.map(|kernel| format!("{} at {}", kernel.name, kernel.subgroup)).collect();
    if spilled.is_empty() {
        return Ok(());
    }
    Err(Error::Check(format!(
        "{} kernels spill registers to memory, which makes them slow: {}",
        spilled.len(),
        spilled.join(", ")
    )))
}

/// Compiles the kernels of a training with labels, and of what happens between its steps.
fn used_kernels(gpu: &Gpu) -> Result<Vec<CompiledKernel>> {
    let shape = KernelShape::for_device(gpu.capabilities());
    let labels = LabelSize { max_label: 255, layers: 10, ..LabelSize::default() };
    let size = EngineSize::new(1 << 20, (1600, 1064)).for_training().with_labels(Some(labels));
    let capacity = capacity(&shape, &size);
    let steps = [Supervision::Photo, Supervision::Disagreement, Supervision::Layers { lift: false }];
    let step = |supervision| training_step(&shape, &capacity, Variant { supervision, ..Variant::plain(size.image) });
    let lists = [Engine::lists_of(&shape, &capacity, &size), steps.map(step).into()].concat();
    let passes = lists.iter().flat_map(|list| list.passes());
    let of_pass = |pass: &PassDecl| (pass.shader.name, pass.shader.specialised(&pass.spec));
    let kernels: BTreeMap<_, _> = passes.map(|pass| (of_pass(pass), pass.shader)).collect();
    compiled(gpu, kernels.into_iter().map(|((_, spec), shader)| (shader, spec, shape.subgroup)).collect())
}

/// All statistics of the driver, by kernel.
pub(crate) fn kernels_json(kernels: &[CompiledKernel]) -> Vec<Value> {
    let row = |kernel: &CompiledKernel| {
        let statistics = kernel.statistics.iter().map(|found| (found.name.clone(), json!(found.value)));
        json!({
            "name": kernel.name, "subgroup_size": kernel.subgroup,
            "statistics": statistics.collect::<Map<String, Value>>(),
        })
    };
    kernels.iter().map(row).collect()
}

/// A row for each kernel and subgroup size.
fn to_text(kernels: &[CompiledKernel]) -> String {
    let mut text = format!("{:<46} {:>8}", "kernel", "subgroup");
    STATISTIC_NAMES.iter().for_each(|(name, _)| text += &format!(" {name:>12}"));
    for kernel in kernels {
        text += &format!("\n{:<46} {:>8}", kernel.name, kernel.subgroup);
        for (_, names) in STATISTIC_NAMES {
            text += &format!(" {:>12}", kernel.figure(names).map_or("-".to_owned(), |value| value.to_string()));
        }
    }
    text + "\n"
}
