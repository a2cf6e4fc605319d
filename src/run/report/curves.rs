//! Charts over the steps.

use super::load::ReportedRun;
use crate::report::text::{DECIBEL_DIGITS, SCORE_DIGITS};
use crate::report::{Chart, Digits, Mark, Scale, Series};
use crate::run::history::{Entry, Steps, ViewScore};
use maud::{Markup, html};
use std::collections::BTreeMap;

/// Most marks of a frequent kind of event.
const MARKS_MAX: usize = 12;
/// Shortest PSNR axis, dB.
const PSNR_AXIS_MIN_DB: f64 = 5.0;
/// Shortest IoU axis.
const IOU_AXIS_MIN: f64 = 0.1;

/// Returns all charts.
pub(super) fn curves(runs: &[ReportedRun]) -> Markup {
    if runs.iter().all(|run| run.history.is_empty()) {
        return html! { p.quiet { "No history.jsonl was found." } };
    }
    let marks = marks(runs);
    let mut charts = losses(runs);
    charts.push(Chart {
        least_span: PSNR_AXIS_MIN_DB,
        digits: Digits::Fixed(DECIBEL_DIGITS),
        ..chart("PSNR", "dB", views_of(runs, |scored| scored.psnr))
    });
    charts.push(Chart {
        least_span: IOU_AXIS_MIN,
        ceiling: Some(1.0),
        digits: Digits::Fixed(SCORE_DIGITS),
        ..chart("Label IoU", "mean over objects", views_of(runs, |scored| scored.iou))
    });
    charts.push(Chart {
        scale: Scale::FromZero,
        digits: Digits::Count,
        ..chart("Gaussians", "", steps_of(runs, |steps| steps.gaussians.into()))
    });
    charts.push(Chart { scale: Scale::FromZero, ..chart("Step time", "ms", steps_of(runs, |steps| steps.ms)) });
    html! {
        p.quiet {
            "Each point of a loss is the mean over ten steps. PSNR and IoU are of the preview view during training, \
            and of all held-out views at the end."
        }
        div.charts {
            @for (index, chart) in charts.into_iter().enumerate() {
                (Chart { marks: marks.clone(), has_legend: index == 0, ..chart }.markup())
            }
        }
    }
}

/// The parts of the loss: one chart for a single run, or one chart per part for several runs.
fn losses(runs: &[ReportedRun]) -> Vec<Chart> {
    let parts: [(&str, fn(&Steps) -> f64); 4] = [
        ("Photo loss", |steps| steps.loss),
        ("L1", |steps| steps.l1),
        ("1 − SSIM", |steps| 1.0 - steps.ssim),
        ("Label loss", |steps| steps.label_loss),
    ];
    let has_labels = runs.iter().flat_map(|run| &run.history).any(is_labelled);
    let parts = parts.into_iter().filter(|part| part.0 != "Label loss" || has_labels);
    let on_log = |title: &str, note: &str, series| Chart { scale: Scale::Logarithmic, ..chart(title, note, series) };
    if let [run] = runs {
        let series = parts.enumerate().map(|(index, (name, value))| step_series(run, name, index, value));
        return vec![on_log("Loss", "logarithmic", series.collect())];
    }
    parts.map(|(name, value)| on_log(name, "logarithmic", steps_of(runs, value))).collect()
}

fn is_labelled(entry: &Entry) -> bool {
    entry.steps().is_some_and(|steps| steps.label_loss != 0.0)
}

fn chart(title: &str, note: &str, series: Vec<Series>) -> Chart {
    Chart { title: title.to_owned(), note: note.to_owned(), series, ..Chart::default() }
}

fn step_series(run: &ReportedRun, name: &str, colour: usize, value: impl Fn(&Steps) -> f64) -> Series {
    let lines = run.history.iter().filter_map(Entry::steps);
    Series::new(name, colour, lines.map(|steps| (f64::from(steps.step), value(steps))))
}

fn steps_of(runs: &[ReportedRun], value: impl Fn(&Steps) -> f64) -> Vec<Series> {
    runs.iter().enumerate().map(|(index, run)| step_series(run, &run.name, index, &value)).collect()
}

/// Scores of the preview view, and the few scores of all held-out views.
fn views_of(runs: &[ReportedRun], value: impl Fn(&ViewScore) -> Option<f64>) -> Vec<Series> {
    let mut series = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let point = |scored: &ViewScore| Some((f64::from(scored.step), value(scored)?));
        let previews = || run.history.iter().filter_map(Entry::preview);
        let ends = run.history.iter().filter_map(Entry::scores).filter_map(point);
        let view = previews().find_map(|scored| scored.view.as_deref());
        let one = runs.len() == 1;
        let (name, all) = if one {
            (format!("view {}", view.unwrap_or_default()), "all held-out views".to_owned())
        } else {
            (run.name.clone(), format!("{}, all held-out views", run.name))
        };
        series.push(Series::new(name, index, previews().filter_map(point)));
        series.push(Series::new(all, if one { 1 } else { index }, ends));
    }
    series
}

/// Events by step. With several runs, events of a single run have its name and colour; events of all runs have neither.
fn marks(runs: &[ReportedRun]) -> Vec<Mark> {
    let mut known: BTreeMap<u32, Vec<(&str, Vec<usize>)>> = BTreeMap::new();
    for (index, run) in runs.iter().enumerate() {
        for (step, text) in events(run) {
            let of_step = known.entry(step).or_default();
            match of_step.iter_mut().find(|(other, _)| *other == text) {
                Some((_, of)) if of.contains(&index) => {}
                Some((_, of)) => of.push(index),
                None => of_step.push((text, vec![index])),
            }
        }
    }
    let mark = |(step, events): (u32, Vec<(&str, Vec<usize>)>)| {
        let is_of_all = |of: &[usize]| of.len() == runs.len();
        let text = |(text, of): &(&str, Vec<usize>)| {
            let names: Vec<&str> = of.iter().map(|&index| runs[index].name.as_str()).collect();
            if is_of_all(of) { (*text).to_owned() } else { format!("{text} ({})", names.join(", ")) }
        };
        let colour = match events.as_slice() {
            [(_, of)] if of.len() == 1 && !is_of_all(of) => of.first().copied(),
            _ => None,
        };
        Mark { step: f64::from(step), text: events.iter().map(text).collect::<Vec<_>>().join(", "), colour }
    };
    known.into_iter().map(mark).collect()
}

/// Events of a run, with their steps.
fn events(run: &ReportedRun) -> Vec<(u32, &'static str)> {
    let train = &run.settings.train;
    let mut events = Vec::new();
    if train.full_size_from() > 0 {
        events.push((train.full_size_from(), "full-size photos"));
    }
    if run.info.masks.is_some() {
        events.push((train.labels_from(), "labels start"));
    }
    events.push((train.densify_until(), "densification ends"));
    let again = run.info.parts.iter().filter(|part| part.after > 0).take(MARKS_MAX);
    events.extend(again.map(|part| (part.after, "resumed")));
    let warned = run.history.iter().filter_map(|entry| match entry {
        Entry::Warning { step, .. } => Some(*step),
        _ => None,
    });
    events.extend(warned.take(MARKS_MAX).map(|step| (step, "warning")));
    events.retain(|event| event.0 > 0 && event.0 < train.iterations);
    events
}
