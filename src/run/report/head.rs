//! What was run, its numbers, warnings and settings.

use super::load::Ran;
use super::{columns, row, run_name};
use crate::report::text::{bytes, count, duration, number, utc};
use crate::run::Settings;
use maud::{Markup, html};

/// What a run decides by itself where the default leaves it open.
const AUTOMATIC: &str = "by the scene and the length of the run";

/// Returns the line below the title.
pub(super) fn lead(runs: &[Ran]) -> Markup {
    let [run] = runs else {
        return html! { p.quiet { "Trainings of labelgs beside each other." } };
    };
    let state = match run.info.ended {
        Some(ended) if ended.stopped => "was stopped",
        Some(_) => "has ended",
        None => "has not ended",
    };
    let of = run.settings.train.iterations;
    html! { p.quiet { "A training of labelgs. It " (state) ": " (count(run.steps().into())) " of " (count(of.into())) " steps." } }
}

/// Returns the main numbers.
pub(super) fn numbers(runs: &[Ran]) -> Markup {
    let rows = [
        row(runs, "PSNR", |run| run.test()?.psnr.map(|value| number(Some(value), 2) + " dB")),
        row(runs, "SSIM", |run| run.test()?.ssim.map(|value| number(Some(value), 4))),
        row(runs, "IoU of labels", |run| run.test()?.iou_map.map(|value| number(Some(value), 4))),
        row(runs, "IoU of objects, visible parts", |run| run.test()?.iou_object.map(|value| number(Some(value), 4))),
        row(runs, "Gaussians", |run| run.gaussians().map(count)),
        row(runs, "Time", |run| run.seconds().map(duration)),
        row(runs, "Device memory", |run| run.info.memory.device_peak.map(bytes)),
        row(runs, "Host memory", |run| run.info.memory.host_peak.map(bytes)),
    ];
    if runs.len() > 1 {
        return columns(runs, &rows);
    }
    let tiles = rows.iter().filter_map(|(name, cells)| Some((name, cells.first()?.as_ref()?)));
    let unscored = runs[0].test().is_none_or(|test| test.psnr.is_none());
    html! {
        dl.numbers { @for (name, value) in tiles { div { dt { (name) } dd { (value) } } } }
        @if unscored { p.quiet { "There are no scores: the run has not ended, or holds out no views." } }
    }
}

/// Returns command, version, device and inputs.
pub(super) fn what(runs: &[Ran]) -> Markup {
    let part = |run: &Ran| run.info.parts.last().cloned();
    let rows = [
        row(runs, "scene", |run| Some(run.info.scene.clone()).filter(|scene| !scene.is_empty())),
        row(runs, "masks", |run| run.info.masks.clone()),
        row(runs, "views", |run| {
            let (train, test) = (run.info.train_views, run.info.test_views);
            (train > 0).then(|| format!("{} to train on, {} held out", count(train), count(test)))
        }),
        row(runs, "seed", |run| Some(run.settings.train.seed.to_string())),
        row(runs, "device", |run| Some(part(run)?.device)),
        row(runs, "labelgs", |run| Some(part(run)?.labelgs)),
        row(runs, "began", |run| Some(utc(run.info.parts.first()?.began))),
        row(runs, "went on", |run| {
            let again = run.info.parts.iter().filter(|part| part.after > 0);
            let again: Vec<String> =
                again.map(|part| format!("after step {} on {}", count(part.after.into()), utc(part.began))).collect();
            (!again.is_empty()).then(|| again.join("; "))
        }),
        row(runs, "folder", |run| Some(run.name.clone())),
    ];
    html! {
        @for (index, run) in runs.iter().enumerate() {
            @for command in run.info.parts.iter().filter_map(|part| part.command.as_deref()) {
                @if runs.len() > 1 { p { (run_name(index, run)) } }
                pre.command { (command) }
            }
        }
        div.below { (columns(runs, &rows)) }
    }
}

/// Returns all warnings.
pub(super) fn warnings(runs: &[Ran]) -> Markup {
    let of = |run: &Ran| run.info.parts.iter().flat_map(|part| part.warnings.clone()).collect::<Vec<String>>();
    html! {
        @for (index, run) in runs.iter().enumerate() {
            @let all = of(run);
            @if runs.len() > 1 { h3 { (run_name(index, run)) } }
            @if all.is_empty() { p.quiet { "None." } }
            @else { ul.warnings { @for text in &all { li { (text) } } } }
        }
    }
}

/// Returns the settings that differ from the defaults, or between the runs.
pub(super) fn settings(runs: &[Ran]) -> Markup {
    let defaults = Settings::default().texts();
    let texts: Vec<_> = runs.iter().map(|run| run.settings.texts()).collect();
    let changed = Settings::keys().filter(|key| texts.iter().any(|own| own.get(key.name) != defaults.get(key.name)));
    let rows: Vec<_> =
        changed.map(|key| (key.name, texts.iter().map(|own| own.get(key.name)).collect::<Vec<_>>())).collect();
    let default = |key: &str| match defaults.get(key).map(String::as_str) {
        None => AUTOMATIC,
        Some("0" | "0.0") if ["near", "budget"].contains(&key) => AUTOMATIC,
        Some(value) => value,
    };
    html! {
        @if rows.is_empty() { p { "All settings are the defaults." } }
        @else {
            p.quiet { "Settings that are not the default; all others are." }
            div.scroll {
                table {
                    thead {
                        tr {
                            th { "setting" }
                            @if let [_] = runs { th { "value" } }
                            @else { @for (index, run) in runs.iter().enumerate() { th { (run_name(index, run)) } } }
                            th { "default" }
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
