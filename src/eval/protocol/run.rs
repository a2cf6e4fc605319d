//! Runs a benchmark on a model: chooses labels, renders, scores.

use super::bench::Bench;
use super::report::{MissingPrediction, Report};
use super::score::{PairScores, score};
use super::select::{Choice, choose};
use super::{Layout, Protocol, Task, TruthFile};
use crate::error::Result;
use crate::eval::compared::{PictureObserver, ScoredPicture};
use crate::eval::metrics::covered;
use crate::eval::subject::Subject;
use crate::files::resize::shrink_photo;
use crate::render::{Parts, RenderOptions};
use crate::scene::View;

/// Returns the largest number of pictures that [`run`] renders, without prompts.
#[cfg(feature = "cli")]
pub(crate) fn picture_count(layout: &Layout) -> u64 {
    layout.tasks.iter().map(|task| task.truths.len() as u64).sum()
}

/// Runs a benchmark. `watch` receives every picture.
pub fn run(
    layout: &Layout,
    bench: &Bench,
    subject: &mut dyn Subject,
    watch: &mut dyn PictureObserver,
) -> Result<Report> {
    let mut report = Report::new(bench.protocol, bench.compat, bench.lpips.is_some());
    report.left_out.clone_from(&layout.left_out);
    // Choose all labels first, because prompts need the whole model.
    subject.show(None)?;
    let choices: Vec<Choice> = layout.tasks.iter().map(|task| choose(task, bench, subject)).collect::<Result<_>>()?;
    for (task, choice) in layout.tasks.iter().zip(choices) {
        let absent = |frame, reason| MissingPrediction { object: task.object.clone(), frame, reason };
        let (labels, reason) = match choice {
            Choice::Labels(labels) => (labels, None),
            Choice::Empty(reason) => {
                report.empty.push(absent(None, reason.clone()));
                (Vec::new(), Some(reason))
            }
            Choice::Missing(reason) => {
                report.missing.push(absent(None, reason.clone()));
                (Vec::new(), Some(reason))
            }
        };
        // The wrapper in the paper's code renders everything if nothing is selected.
        let whole_scene = bench.compat && bench.protocol == Protocol::Labelgs;
        let reason = reason.filter(|_| !whole_scene);
        if reason.is_none() {
            subject.show(Some(&labels[..]).filter(|labels| !labels.is_empty()))?;
        }
        report.object(&task.object, labels);
        for truth in &task.truths {
            let Some(view) = bench.view(&truth.frame) else {
                let reason = format!("the scene has no view {}", truth.frame);
                report.missing.push(absent(Some(truth.frame.clone()), reason));
                add_absent(&mut report, bench, task, truth);
                watch.skip()?;
                continue;
            };
            let scores = score_one(task, truth, view, reason.as_deref(), bench, subject, watch)?;
            match reason {
                Some(_) => add_absent(&mut report, bench, task, truth),
                None => report.add(&task.object, &truth.frame, scores),
            }
        }
    }
    report.finish();
    Ok(report)
}

/// Adds a missing prediction. It counts as 0; Gaussian Grouping's scorer excludes it.
fn add_absent(report: &mut Report, bench: &Bench, task: &Task, truth: &TruthFile) {
    if bench.compat && bench.protocol == Protocol::LerfMask {
        report.left_out.push(format!("{} in {} has no prediction and is not counted", task.object, truth.frame));
    } else {
        report.add(&task.object, &truth.frame, PairScores::absent(bench.lpips.is_some()));
    }
}

/// Scores the current selection in a frame, or a missing prediction with its reason.
fn score_one(
    task: &Task,
    truth: &TruthFile,
    view: &View,
    reason: Option<&str>,
    bench: &Bench,
    subject: &mut dyn Subject,
    watch: &mut dyn PictureObserver,
) -> Result<PairScores> {
    let mask = (bench.truth)(&truth.file, view)?;
    let photo = shrink_photo(&*view.photo()?, mask.width, mask.height);
    let pixels = mask.inside.len();
    let (scores, found, rgb) = if reason.is_some() {
        (PairScores::absent(bench.lpips.is_some()), vec![false; pixels], vec![[0.0; 3]; pixels])
    } else {
        let camera = view.camera.resized(mask.width, mask.height);
        let rendered = subject.render(&camera, &RenderOptions::new(bench.near, Parts::COLOUR))?;
        let scores = score(&rendered, &mask, &photo, bench.compat, bench.lpips)?;
        (scores, covered(&rendered.alpha), rendered.rgb)
    };
    watch.observe(&ScoredPicture {
        object: Some(task.object.clone()),
        masks: Some((&found, &mask.inside)),
        numbers: scores.named(),
        note: reason.unwrap_or_default().to_owned(),
        ..ScoredPicture::new(&truth.frame, &photo, &rgb)
    })?;
    Ok(scores)
}
