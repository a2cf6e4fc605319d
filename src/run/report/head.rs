//! The head of a report: command, main numbers, warnings and settings.

use super::load::ReportedRun;
use super::{columns, row, run_name};
use crate::report::text::{DECIBEL_DIGITS, SCORE_DIGITS, bytes, count, duration, number, utc};
use crate::run::Settings;
use maud::{Markup, html};
use std::path::Path;

/// What a run decides by itself where the default leaves it open.
const AUTOMATIC_TEXT: &str = "automatic";

/// Returns the title: the name of the scene, or of the run if the scene is unknown.
pub(super) fn title(runs: &[ReportedRun]) -> String {
    let scene = |run: &ReportedRun| {
        let name = Path::new(&run.info.scene).file_name();
        name.map_or_else(|| run.name.clone(), |name| name.to_string_lossy().into_owned())
    };
    let mut scenes: Vec<String> = runs.iter().map(scene).collect();
    scenes.dedup();
    match (runs, scenes.as_slice()) {
        ([_], [scene]) => scene.clone(),
        (_, [scene]) => format!("{scene}: {} runs", runs.len()),
        _ => format!("{} runs", runs.len()),
    }
}

/// Returns the line below the title.
pub(super) fn lead(runs: &[ReportedRun]) -> Markup {
    let [run] = runs else {
        return html! { p.quiet { "labelgs runs, side by side." } };
    };
    let state = match run.info.ended {
        Some(ended) if ended.stopped => "stopped",
        Some(_) => "finished",
        None => "not finished",
    };
    let of = run.settings.train.iterations;
    html! {
        p.quiet {
            "labelgs run, " (state) ": " (count(run.steps().into())) " of " (count(of.into())) " steps"
            @if let Some(gaussians) = run.gaussians() { ", " (count(gaussians)) " Gaussians" }
        }
    }
}

/// Returns the main numbers.
pub(super) fn numbers(runs: &[ReportedRun]) -> Markup {
    let score = |value: f64| number(Some(value), SCORE_DIGITS);
    let main = [
        row(runs, "PSNR", |run| run.test()?.psnr.map(|value| number(Some(value), DECIBEL_DIGITS) + " dB")),
        row(runs, "SSIM", |run| run.test()?.ssim.map(score)),
        row(runs, "Label IoU", |run| run.test()?.iou_map.map(score)),
        row(runs, "Time", |run| run.seconds().map(duration)),
    ];
    if runs.len() > 1 {
        let size = row(runs, "Gaussians", |run| run.gaussians().map(count));
        return columns(runs, &main.into_iter().chain([size]).chain(more_numbers(runs)).collect::<Vec<_>>());
    }
    let tiles = main.iter().filter_map(|(name, cells)| Some((name, cells.first()?.as_ref()?)));
    let unscored = runs[0].test().is_none_or(|test| test.psnr.is_none());
    html! {
        dl.numbers { @for (name, value) in tiles { div { dt { (name) } dd { (value) } } } }
        @if unscored { p.quiet { "No scores: the run has not finished, or has no held-out views." } }
    }
}

/// Numbers for a second look.
fn more_numbers(runs: &[ReportedRun]) -> [(String, Vec<Option<String>>); 3] {
    let objects = "Object IoU, visible parts";
    [
        row(runs, objects, |run| run.test()?.iou_object.map(|value| number(Some(value), SCORE_DIGITS))),
        row(runs, "Device memory", |run| run.info.memory.device_peak.map(bytes)),
        row(runs, "Host memory", |run| run.info.memory.host_peak.map(bytes)),
    ]
}

/// Returns command, version, device and inputs.
pub(super) fn what(runs: &[ReportedRun]) -> Markup {
    let part = |run: &ReportedRun| run.info.parts.last().cloned();
    let mut rows = vec![
        row(runs, "scene", |run| Some(run.info.scene.clone()).filter(|scene| !scene.is_empty())),
        row(runs, "masks", |run| run.info.masks.clone()),
        row(runs, "views", |run| {
            let (train, test) = (run.info.train_views, run.info.test_views);
            (train > 0).then(|| format!("{} training, {} held out", count(train), count(test)))
        }),
        row(runs, "seed", |run| Some(run.settings.train.seed.to_string())),
        row(runs, "device", |run| Some(part(run)?.device)),
        row(runs, "labelgs", |run| Some(part(run)?.labelgs)),
        row(runs, "started", |run| Some(utc(run.info.parts.first()?.began))),
        row(runs, "resumed", |run| {
            let again = run.info.parts.iter().filter(|part| part.after > 0);
            let again: Vec<String> =
                again.map(|part| format!("after step {} on {}", count(part.after.into()), utc(part.began))).collect();
            (!again.is_empty()).then(|| again.join("; "))
        }),
        row(runs, "folder", |run| Some(run.name.clone())),
    ];
    if runs.len() == 1 {
        rows.extend(more_numbers(runs));
    }
    html! {
        div.commands {
            @for (index, run) in runs.iter().enumerate() {
                @for command in run.info.parts.iter().filter_map(|part| part.command.as_deref()) {
                    @if runs.len() > 1 { (run_name(index, run)) }
                    pre.command { (command) }
                }
            }
        }
        (columns(runs, &rows))
    }
}

/// Returns all warnings; empty if there are none.
pub(super) fn warnings(runs: &[ReportedRun]) -> Option<Markup> {
    let of = |run: &ReportedRun| run.info.parts.iter().flat_map(|part| part.warnings.clone()).collect::<Vec<String>>();
    let all: Vec<(usize, Vec<String>)> = runs.iter().map(of).enumerate().filter(|(_, all)| !all.is_empty()).collect();
    let markup = html! {
        @for (index, all) in &all {
            @if runs.len() > 1 { h3 { (run_name(*index, &runs[*index])) } }
            ul.warnings { @for text in all { li { (text) } } }
        }
    };
    (!all.is_empty()).then_some(markup)
}

/// Returns the settings that differ from the defaults, or between the runs.
pub(super) fn settings(runs: &[ReportedRun]) -> Markup {
    let defaults = Settings::default().texts();
    let texts: Vec<_> = runs.iter().map(|run| run.settings.texts()).collect();
    let changed = Settings::keys().filter(|key| texts.iter().any(|own| own.get(key.name) != defaults.get(key.name)));
    let rows: Vec<_> =
        changed.map(|key| (key.name, texts.iter().map(|own| own.get(key.name)).collect::<Vec<_>>())).collect();
    let default = |key: &str| match defaults.get(key).map(String::as_str) {
        None => AUTOMATIC_TEXT,
        Some("0" | "0.0") if ["near", "budget"].contains(&key) => AUTOMATIC_TEXT,
        Some(value) => value,
    };
    html! {
        @if rows.is_empty() { p { "All settings have their default values." } }
        @else {
            p.quiet { "Settings that differ from the default, by their names in config.toml." }
            div.scroll {
                table {
                    thead {
                        tr {
                            th { "Setting" }
                            @if let [_] = runs { th { "Value" } }
                            @else { @for (index, run) in runs.iter().enumerate() { th { (run_name(index, run)) } } }
                            th { "Default" }
                        }
                    }
                    tbody {
                        @for (key, values) in &rows {
                            tr {
                                th { code { (key) } }
                                @for value in values { td { (value.map_or("not set", String::as_str)) } }
                                td.quiet { (default(key)) }
                            }
                        }
                    }
                }
            }
        }
    }
}
