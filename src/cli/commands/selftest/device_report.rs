//! `labelgs selftest --report`: what the authors need to know of a device that they do not have.

use crate::cli::commands::devices;
use crate::cli::commands::kernels::kernels_json;
use crate::cli::commands::profile::report::Window;
use crate::cli::commands::profile::{finished_from, profile};
use crate::cli::commands::selftest;
use crate::cli::support::{Context, open_gpu};
use crate::gpu::{self, Gpu, GpuOptions};
use crate::pass::compiled_kernels;
use crate::synth::{self, SynthOptions};
use crate::train::{TrainConfig, first_model};
use crate::verify::selftest::Check;
use crate::{Error, Result};
use serde_json::{Value, json};

/// Returns the report. `error` ended the checks. A failed measurement is reported as an error of its own.
pub(crate) fn report(checks: &[Check], error: Option<&Error>, context: &Context) -> Result<Value> {
    let options = context.gpu_options()?;
    let (found, picked) = gpu::devices(&options)?;
    let picked = picked.ok();
    let listed = found.iter().map(|device| {
        let mut row = devices::to_json(device, picked);
        // The UUID would identify the machine.
        row.as_object_mut().and_then(|row| row.remove("uuid"));
        row
    });
    Ok(json!({
        "schema_version": 1,
        "labelgs": crate::version::text(),
        "system": { "os": std::env::consts::OS, "processor": std::env::consts::ARCH },
        "devices": listed.collect::<Vec<_>>(),
        "checks": checks.iter().map(selftest::to_json).collect::<Vec<_>>(),
        "error": error.map(Error::to_string),
        "compiler": measured(picked.is_some(), || compiler(options)),
        "steps": measured(picked.is_some(), || steps(context)),
    }))
}

/// A measurement, or the error that prevented it; null without a device.
fn measured(has_device: bool, measure: impl FnOnce() -> Result<Value>) -> Value {
    if !has_device {
        return Value::Null;
    }
    measure().unwrap_or_else(|error| json!({ "error": error.to_string() }))
}

/// Compiler statistics of every kernel.
fn compiler(options: GpuOptions) -> Result<Value> {
    let gpu = Gpu::new(&GpuOptions { statistics: true, ..options })?;
    Ok(json!(kernels_json(&compiled_kernels(&gpu)?)))
}

/// The profile of steps with labels on the built-in scene: a million Gaussians at 1600 x 1064 px on a GPU with the
/// memory for them, else the scene's own size.
fn steps(context: &Context) -> Result<Value> {
    const LARGE_MIN: u64 = 3 << 30;
    let gpu = open_gpu(context)?;
    let scene = SynthOptions { views: 8, ..SynthOptions::default() };
    let scene = if gpu.is_cpu() || gpu.limits().plan.max_memory < LARGE_MIN {
        scene
    } else {
        SynthOptions { width: 1600, height: 1064, points: 1_000_000, ..scene }
    };
    let dataset = synth::dataset(&scene, 0);
    let config = finished_from(0, TrainConfig::default());
    let model = first_model(&dataset, &config)?;
    let window = Window { overlap: true, from_step: 0, warm_up: 10, steps: 20 };
    Ok(json!(profile(&gpu, (&dataset, &model, config), window, context)?))
}
