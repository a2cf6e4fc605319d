//! Runs a benchmark on a model: chooses labels, renders, scores.

use super::bench::Bench;
use super::paint::Painter;
use super::report::{Absent, Report};
use super::score::{PairScores, score};
use super::select::{Choice, choose};
use super::{Layout, Protocol, Task, Truth};
use crate::error::Result;
use crate::eval::compared::{Compared, Watch};
use crate::eval::metrics::COVERED;
use crate::files::resize::shrink_photo;
use crate::scene::View;

/// Returns the largest number of pictures that [`run`] renders, without prompts.
#[cfg(feature = "cli")]
pub(crate) fn picture_count(layout: &Layout) -> u64 {
    layout.tasks.iter().map(|task| task.truths.len() as u64).sum()
}

/// Runs a benchmark. `watch` receives every picture.
pub fn run(layout: &Layout, bench: &Bench, painter: &mut dyn Painter, watch: &mut dyn Watch) -> Result<Report> {
    let mut report = Report::new(bench.protocol, bench.compat, bench.lpips.is_some());
    report.left_out.clone_from(&layout.left_out);
    // Choose all labels first: prompts need the whole model.
    let choices: Vec<Choice> = layout.tasks.iter().map(|task| choose(task, bench, painter)).collect::<Result<_>>()?;
    for (task, choice) in layout.tasks.iter().zip(&choices) {
        let object = || task.object.clone();
        let (labels, absent) = match choice {
            Choice::Labels(labels) => (labels.clone(), None),
            Choice::Empty(reason) => {
                report.empty.push(Absent { object: object(), frame: None, reason: reason.clone() });
                (Vec::new(), Some(reason))
            }
            Choice::Missing(reason) => {
                report.missing.push(Absent { object: object(), frame: None, reason: reason.clone() });
                (Vec::new(), Some(reason))
            }
        };
        report.object(&task.object, labels.clone());
        for truth in &task.truths {
            let Some(view) = bench.view(&truth.frame) else {
                let reason = format!("the scene has no view {}", truth.frame);
                report.missing.push(Absent { object: object(), frame: Some(truth.frame.clone()), reason });
                add_absent(&mut report, bench, task, truth);
                watch.skip()?;
                continue;
            };
            // The wrapper in the paper's code renders everything if nothing is selected.
            let whole_scene = bench.compat && bench.protocol == Protocol::Labelgs;
            match (&labels[..], absent) {
                ([], Some(reason)) if !whole_scene => {
                    add_absent(&mut report, bench, task, truth);
                    show_absent(task, truth, view, bench, reason, watch)?;
                }
                _ => {
                    let labels = Some(&labels[..]).filter(|labels| !labels.is_empty());
                    let scores = score_one(task, truth, view, labels, bench, painter, watch)?;
                    report.add(&task.object, &truth.frame, scores);
                }
            }
        }
    }
    report.finish();
    Ok(report)
}

/// Adds a missing prediction. It counts as 0; the scorer of Gaussian Grouping leaves it out.
fn add_absent(report: &mut Report, bench: &Bench, task: &Task, truth: &Truth) {
    if bench.compat && bench.protocol == Protocol::LerfMask {
        report.left_out.push(format!("{} in {} has no prediction and is not counted", task.object, truth.frame));
    } else {
        report.add(&task.object, &truth.frame, PairScores::absent(bench.lpips.is_some()));
    }
}

fn score_one(
    task: &Task,
    truth: &Truth,
    view: &View,
    labels: Option<&[u32]>,
    bench: &Bench,
    painter: &mut dyn Painter,
    watch: &mut dyn Watch,
) -> Result<PairScores> {
    let mask = (bench.truth)(&truth.file, view)?;
    let photo = view.photo()?;
    let photo = shrink_photo(&photo, mask.width, mask.height);
    let drawn = painter.draw(labels, &view.camera.resized(mask.width, mask.height))?;
    let scores = score(&drawn, &mask, &photo, bench.compat, bench.lpips)?;
    let found: Vec<bool> = drawn.alpha.iter().map(|&alpha| alpha > COVERED).collect();
    watch.see(&Compared {
        object: Some(task.object.clone()),
        masks: Some((&found, &mask.inside)),
        numbers: scores.named().to_vec(),
        ..Compared::new(&truth.frame, &photo, &drawn.rgb)
    })?;
    Ok(scores)
}

fn show_absent(
    task: &Task,
    truth: &Truth,
    view: &View,
    bench: &Bench,
    reason: &str,
    watch: &mut dyn Watch,
) -> Result<()> {
    let mask = (bench.truth)(&truth.file, view)?;
    let Some(photo) = &view.photo else { return watch.skip() };
    let photo = photo.get()?;
    let photo = shrink_photo(&photo, mask.width, mask.height);
    let pixels = mask.inside.len();
    watch.see(&Compared {
        object: Some(task.object.clone()),
        masks: Some((&vec![false; pixels], &mask.inside)),
        numbers: PairScores::absent(bench.lpips.is_some()).named().to_vec(),
        note: reason.to_owned(),
        ..Compared::new(&truth.frame, &photo, &vec![[0.0; 3]; pixels])
    })
}
