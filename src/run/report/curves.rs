//! Curves over the steps.

use super::load::Ran;
use crate::report::{Chart, Mark, Series};
use crate::run::history::{Entry, Scored, Steps};
use maud::{Markup, html};

/// Most marks of a kind that may come often.
const MARKS_MAX: usize = 12;

/// Returns all charts.
pub(super) fn curves(runs: &[Ran]) -> Markup {
    if runs.iter().all(|run| run.history.is_empty()) {
        return html! { p.quiet { "There is no history.jsonl." } };
    }
    let marks: Vec<Mark> =
        runs.iter().enumerate().flat_map(|(index, run)| marks(run, (runs.len() > 1).then_some(index))).collect();
    let mut charts = losses(runs);
    charts.push(chart("PSNR", "dB", views_of(runs, |scored| scored.psnr)));
    charts.push(chart("IoU of labels", "mean over objects", views_of(runs, |scored| scored.iou)));
    charts.push(Chart { from_zero: true, ..chart("Gaussians", "", steps_of(runs, |steps| steps.gaussians.into())) });
    charts.push(Chart { from_zero: true, ..chart("Time of a step", "ms", steps_of(runs, |steps| steps.ms)) });
    html! {
        p.quiet {
            "Points are means over ten steps, of one photo each; PSNR and IoU are of the view of the previews, and of all \
             held-out views at the end. Dashed lines are events."
        }
        div.charts { @for chart in charts { (Chart { marks: marks.clone(), ..chart }.markup()) } }
    }
}

/// The parts of the loss: in one chart for one run, in a chart each for several.
fn losses(runs: &[Ran]) -> Vec<Chart> {
    let parts: [(&str, fn(&Steps) -> f64); 5] = [
        ("photo loss", |steps| steps.loss),
        ("L1", |steps| steps.l1),
        ("1 − SSIM", |steps| 1.0 - steps.ssim),
        ("label loss", |steps| steps.label_loss),
        ("largest photo loss of ten steps", |steps| steps.loss_max),
    ];
    let is_there = |part: &(&str, fn(&Steps) -> f64)| {
        part.0 != "label loss" || runs.iter().flat_map(|run| &run.history).any(is_labelled)
    };
    let parts = parts.into_iter().filter(is_there);
    if let [run] = runs {
        let (worst, parts): (Vec<_>, Vec<_>) = parts.partition(|part| part.0.starts_with("largest"));
        let series = parts.into_iter().enumerate().map(|(index, (name, value))| of_steps(run, name, index, value));
        let worst = worst.into_iter().map(|(name, value)| of_steps(run, name, 1, value));
        return vec![
            Chart { from_zero: true, ..chart("Loss", "", series.collect()) },
            Chart { from_zero: true, ..chart("Largest photo loss of ten steps", "", worst.collect()) },
        ];
    }
    parts.map(|(name, value)| Chart { from_zero: true, ..chart(name, "", steps_of(runs, value)) }).collect()
}

fn is_labelled(entry: &Entry) -> bool {
    entry.steps().is_some_and(|steps| steps.label_loss != 0.0)
}

fn chart(title: &str, note: &str, series: Vec<Series>) -> Chart {
    Chart { title: title.to_owned(), note: note.to_owned(), series, ..Chart::default() }
}

fn of_steps(run: &Ran, name: &str, colour: usize, value: impl Fn(&Steps) -> f64) -> Series {
    let lines = run.history.iter().filter_map(Entry::steps);
    Series::new(name, colour, lines.map(|steps| (f64::from(steps.step), value(steps))))
}

fn steps_of(runs: &[Ran], value: impl Fn(&Steps) -> f64) -> Vec<Series> {
    runs.iter().enumerate().map(|(index, run)| of_steps(run, &run.name, index, &value)).collect()
}

/// Scores of the view of the previews, and those of all held-out views, which are few points.
fn views_of(runs: &[Ran], value: impl Fn(&Scored) -> Option<f64>) -> Vec<Series> {
    let mut series = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let point = |scored: &Scored| Some((f64::from(scored.step), value(scored)?));
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

/// Events of a run. Those of several runs have the colours of the runs.
fn marks(run: &Ran, colour: Option<usize>) -> Vec<Mark> {
    let train = &run.settings.train;
    let last = f64::from(train.iterations);
    let mark = |step: u32, text: &str| {
        let text = if colour.is_some() { format!("{}: {text}", run.name) } else { text.to_owned() };
        Mark { step: f64::from(step), text, colour }
    };
    let mut marks = vec![mark(train.densify_until(), "growth ends")];
    if run.info.masks.is_some() {
        marks.push(mark(train.labels_from(), "labels begin"));
    }
    if train.full_size_from() > 0 {
        marks.push(mark(train.full_size_from(), "photos at full size"));
    }
    let again = run.info.parts.iter().filter(|part| part.after > 0).take(MARKS_MAX);
    marks.extend(again.map(|part| mark(part.after, "went on")));
    let warned = run.history.iter().filter_map(|entry| match entry {
        Entry::Warning { step, .. } => Some(*step),
        _ => None,
    });
    marks.extend(warned.take(MARKS_MAX).map(|step| mark(step, "warning")));
    marks.retain(|mark| mark.step > 0.0 && mark.step < last);
    marks.sort_by(|a, b| a.step.total_cmp(&b.step));
    // Events of one step share a mark.
    let mut joined: Vec<Mark> = Vec::new();
    for mark in marks {
        match joined.last_mut().filter(|before| before.step == mark.step && colour.is_none()) {
            Some(before) if before.text.contains(&mark.text) => {}
            Some(before) => before.text += &format!(", {}", mark.text),
            None => joined.push(mark),
        }
    }
    joined
}
