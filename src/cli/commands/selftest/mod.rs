//! `labelgs selftest`.

pub(crate) mod device_report;

use crate::cli::commands::devices::{needs_json, needs_text, shape_json, shape_text};
use crate::cli::support::{Context, open_gpu, stdout};
use crate::pass::KernelShape;
use crate::verify::selftest::{self, Check};
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `labelgs selftest`.
#[derive(Args, Clone, Debug)]
pub struct SelftestArgs {
    /// Write a device report to FILE, to send to the authors: GPU and driver, test results, compiler statistics and
    /// step times. It contains nothing personal.
    #[arg(long, value_name = "FILE.json", help_heading = "Output")]
    pub report: Option<PathBuf>,
}

/// Runs the checks and prints a row for each, and writes the report. Fails if a check fails.
pub(crate) fn run(args: &SelftestArgs, context: &Context) -> Result<()> {
    let Some(file) = &args.report else { return checked(context, &mut Vec::new()) };
    let mut checks = Vec::new();
    let outcome = checked(context, &mut checks);
    crate::files::atomic::write_json(file, &device_report::report(&checks, outcome.as_ref().err(), context)?)?;
    tracing::info!("wrote {}; please send it to the authors of labelgs", file.display());
    outcome
}

/// Runs the checks, and collects them.
fn checked(context: &Context, checks: &mut Vec<Check>) -> Result<()> {
    let gpu = open_gpu(context)?;
    let (found, kernels) = (gpu.capabilities(), KernelShape::for_device(gpu.capabilities()));
    let as_json = context.json;
    if !as_json {
        stdout::print(&format!(
            "{} ({} {})\n{}{}\n\n{:<48} {:>8} {:>8}  {}\n",
            found.name,
            found.driver_name,
            found.driver_info,
            needs_text(found),
            shape_text(&kernels),
            "check against float64",
            "error",
            "seconds",
            "(relative to the tolerance: 1 is the maximum)"
        ))?;
    }
    let mut printed = Ok(());
    selftest::run(&gpu, |check| {
        if !as_json && printed.is_ok() {
            printed = stdout::print(&row(&check));
        }
        checks.push(check);
    })?;
    printed?;
    let failed: Vec<&str> = checks.iter().filter(|c| c.verdict.is_err()).map(|c| c.name.as_str()).collect();
    if as_json {
        stdout::print_json(&json!({
            "schema_version": 1,
            "device": found.name,
            "driver": { "name": found.driver_name, "version": found.driver_info },
            "needs": needs_json(found),
            "kernels": shape_json(&kernels),
            "passed": failed.is_empty(),
            "checks": checks.iter().map(to_json).collect::<Vec<_>>(),
        }))?;
    }
    if failed.is_empty() {
        return Ok(());
    }
    Err(Error::Check(format!(
        "{} of {} checks of this device failed ({}); try another driver version or another --device, and report it",
        failed.len(),
        checks.len(),
        failed.join("; ")
    )))
}

fn row(check: &Check) -> String {
    match (&check.verdict, check.worst()) {
        (Err(text), _) => format!("{:<48} {:>8} {:>8.1}  {text}\n", check.name, "FAILED", check.seconds),
        (Ok(_), worst) => format!("{:<48} {:>8.3} {:>8.1}\n", check.name, worst.unwrap_or(0.0), check.seconds),
    }
}

/// Returns a check as JSON.
pub(crate) fn to_json(check: &Check) -> serde_json::Value {
    json!({
        "name": check.name,
        "passed": check.verdict.is_ok(),
        "error": check.worst(),
        "problem": check.verdict.as_ref().err(),
        "seconds": check.seconds,
    })
}
