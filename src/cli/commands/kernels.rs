//! `labelgs kernels`: what the driver's compiler makes of every kernel.

use crate::cli::support::args::JsonFlag;
use crate::cli::support::context::Context;
use crate::cli::support::stdout;
use crate::gpu::{Gpu, GpuOptions};
use crate::pass::{CompiledKernel, FIGURES, compiled_kernels};
use crate::{Error, Result};
use clap::Args;
use serde_json::{Map, Value, json};

/// `labelgs kernels`.
#[derive(Args, Clone, Debug)]
pub struct KernelsArgs {
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
}

/// Prints the table. Fails if a kernel spills registers.
pub(crate) fn run(args: &KernelsArgs, context: &Context) -> Result<()> {
    let gpu = Gpu::new(&GpuOptions { statistics: true, ..context.gpu_options()? })?;
    context.listen(&gpu);
    let (found, kernels) = (gpu.capabilities(), compiled_kernels(&gpu)?);
    if context.json || args.json.json {
        stdout::print_json(&json!({
            "schema_version": 1,
            "device": found.name,
            "driver": { "name": found.driver_name, "version": found.driver_info },
            "kernels": kernels_json(&kernels),
        }))?;
    } else {
        stdout::print(&format!("{} ({} {})\n", found.name, found.driver_name, found.driver_info))?;
        stdout::print(&to_text(&kernels))?;
    }
    let spilled = kernels.iter().filter(|kernel| kernel.spills() > 0.0);
    let spilled: Vec<String> = spilled.map(|kernel| format!("{} at {}", kernel.name, kernel.subgroup)).collect();
    if spilled.is_empty() {
        return Ok(());
    }
    Err(Error::Check(format!(
        "the driver keeps registers of {} kernels in memory, which makes them slow: {}",
        spilled.len(),
        spilled.join(", ")
    )))
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
    FIGURES.iter().for_each(|(name, _)| text += &format!(" {name:>12}"));
    for kernel in kernels {
        text += &format!("\n{:<46} {:>8}", kernel.name, kernel.subgroup);
        for (_, names) in FIGURES {
            text += &format!(" {:>12}", kernel.figure(names).map_or("-".to_owned(), |value| value.to_string()));
        }
    }
    text + "\n"
}
