//! `labelgs kernels`: what the driver's compiler makes of every kernel.

use crate::cli::support::Context;
use crate::gpu::{Gpu, GpuOptions};
use crate::pass::{CompiledKernel, STATISTIC_NAMES, compiled_kernels};
use crate::{Error, Result};
use serde_json::{Map, Value, json};

/// Prints the table. Fails if a kernel spills registers.
pub(crate) fn run(context: &Context) -> Result<()> {
    let gpu = Gpu::new(&GpuOptions { statistics: true, ..context.gpu_options()? })?;
    context.listen(&gpu);
    let (found, kernels) = (gpu.capabilities(), compiled_kernels(&gpu)?);
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
