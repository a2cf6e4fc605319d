//! Planned and measured memory, and times by pass.

use super::load::ReportedRun;
use super::{columns, row, run_name};
use crate::report::text::{bytes, count, number, significant};
use crate::run::passes::Pass;
use maud::{Markup, html};

/// Most stages with their own bar.
const STAGES_MAX: usize = 8;

/// Returns both sections.
pub(super) fn costs(runs: &[ReportedRun]) -> Markup {
    let rows = [
        row(runs, "planned at the start", |run| run.info.memory.planned_start.map(bytes)),
        row(runs, "planned at the end", |run| run.info.memory.planned_end.map(bytes)),
        row(runs, "peak device memory", |run| run.info.memory.device_peak.map(bytes)),
        row(runs, "peak host memory", |run| run.info.memory.host_peak.map(bytes)),
    ];
    html! {
        h3 { "Step time by stage" }
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
                    "Not measured: the run has not ended, is too short, or its device has no timestamps. To show a \
                     profile here, write it to profile.json in the run folder."
                },
                None => {
                    p.quiet {
                        "Means over the last steps, which were repeated after training with a barrier before each \
                         pass."
                    }
                    (passes(&run.info.passes))
                }
            }
        }
        h3 { "Memory" }
        (columns(runs, &rows))
        @if let [run] = runs { (buffers(run)) }
    }
}

fn buffers(run: &ReportedRun) -> Markup {
    let buffers = &run.info.memory.buffers;
    let largest = buffers.iter().map(|row| row.1).max().unwrap_or(1).max(1);
    html! {
        @if !buffers.is_empty() {
            details {
                summary { "Largest buffers at the end" }
                p.quiet { "Scratch buffers share memory, so the sum may exceed the plan." }
                (bars(buffers.iter().map(|(name, size)| (name.clone(), bytes(*size), *size as f64 / largest as f64))))
            }
        }
    }
}

/// A bar for each of the largest stages, and one for the others; all passes on demand.
fn passes(passes: &[Pass]) -> Markup {
    let mut stages: Vec<(String, f64, f64)> = Vec::new();
    for pass in passes {
        match stages.iter_mut().find(|stage| stage.0 == pass.stage) {
            Some(stage) => (stage.1, stage.2) = (stage.1 + pass.ms, stage.2 + pass.share),
            None => stages.push((pass.stage.clone(), pass.ms, pass.share)),
        }
    }
    let mut by_share: Vec<f64> = stages.iter().map(|stage| stage.2).collect();
    by_share.sort_by(|a, b| b.total_cmp(a));
    let least = by_share.get(STAGES_MAX - 1).copied().unwrap_or(0.0);
    let (large, small): (Vec<_>, Vec<_>) = stages.into_iter().partition(|stage| stage.2 >= least);
    let rest = small.iter().fold((0.0, 0.0), |sum, stage| (sum.0 + stage.1, sum.1 + stage.2));
    let rest = (!small.is_empty()).then(|| ("others".to_owned(), rest.0, rest.1));
    let title = |pass: &Pass| {
        if pass.name.is_empty() { pass.stage.clone() } else { format!("{}: {}", pass.stage, pass.name) }
    };
    html! {
        (times(large.into_iter().chain(rest).collect()))
        details {
            summary { "All " (passes.len()) " passes" }
            (times(passes.iter().map(|pass| (title(pass), pass.ms, pass.share)).collect()))
        }
    }
}

/// Bars of names, times in ms, and shares.
fn times(rows: Vec<(String, f64, f64)>) -> Markup {
    let largest = rows.iter().map(|row| row.2).fold(f64::MIN_POSITIVE, f64::max);
    bars(rows.into_iter().map(|(name, ms, share)| {
        (name, format!("{} ms, {} %", significant(ms), number(Some(100.0 * share), 1)), share / largest)
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
