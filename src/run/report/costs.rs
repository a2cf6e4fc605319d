//! Memory planned and measured, and times by pass.

use super::load::Ran;
use super::{columns, row, run_name};
use crate::report::text::{bytes, count, number};
use crate::run::passes::Pass;
use maud::{Markup, html};

/// Returns both.
pub(super) fn costs(runs: &[Ran]) -> Markup {
    let rows = [
        row(runs, "device memory planned at the start", |run| run.info.memory.planned_start.map(bytes)),
        row(runs, "planned for the last model", |run| run.info.memory.planned_end.map(bytes)),
        row(runs, "most used by buffers", |run| run.info.memory.device_peak.map(bytes)),
        row(runs, "most host memory of the process", |run| run.info.memory.host_peak.map(bytes)),
    ];
    html! {
        h3 { "Memory" }
        (columns(runs, &rows))
        @if let [run] = runs { (buffers(run)) }
        h3 { "Time by pass" }
        @for (index, run) in runs.iter().enumerate() {
            @if runs.len() > 1 { p { (run_name(index, run)) } }
            @match &run.profile {
                Some(profile) => {
                    p.quiet {
                        "A profile on " (profile.device) " with " (count(profile.gaussians.into()))
                        " Gaussians; medians."
                    }
                    (passes(&profile.passes))
                }
                None if run.info.passes.is_empty() => p.quiet {
                    "Not measured: the run has not ended, or is too short, or its device has no clock. A profile of \
                     the scene that is written to profile.json in the folder of the run is shown here."
                },
                None => {
                    p.quiet {
                        "Means over the last steps, which ran once more after the end of the training, with a barrier \
                         before each pass."
                    }
                    (passes(&run.info.passes))
                }
            }
        }
    }
}

fn buffers(run: &Ran) -> Markup {
    let buffers = &run.info.memory.buffers;
    let largest = buffers.iter().map(|row| row.1).max().unwrap_or(1).max(1);
    html! {
        @if !buffers.is_empty() {
            details {
                summary { "The largest buffers of the last plan" }
                p.quiet { "Scratch buffers share memory, so the sum may exceed the plan." }
                (bars(buffers.iter().map(|(name, size)| (name.clone(), bytes(*size), *size as f64 / largest as f64))))
            }
        }
    }
}

fn passes(passes: &[Pass]) -> Markup {
    let largest = passes.iter().map(|pass| pass.share).fold(f64::MIN_POSITIVE, f64::max);
    bars(passes.iter().map(|pass| {
        let title = if pass.name.is_empty() { pass.stage.clone() } else { format!("{}: {}", pass.stage, pass.name) };
        let time = format!("{} ms, {} %", number(Some(pass.ms), 3), number(Some(100.0 * pass.share), 1));
        (title, time, pass.share / largest)
    }))
}

fn bars(rows: impl Iterator<Item = (String, String, f64)>) -> Markup {
    html! {
        table.bars {
            tbody {
                @for (name, text, share) in rows {
                    tr {
                        th { (name) }
                        td.right { (text) }
                        td.share { i style=(format!("width:{:.1}%", 100.0 * share.clamp(0.0, 1.0))) {} }
                    }
                }
            }
        }
    }
}
