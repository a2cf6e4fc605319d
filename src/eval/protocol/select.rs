//! Chooses the labels of a benchmark's object in the model.

use super::bench::Bench;
use super::{Prompt, Task};
use crate::edit::choose::{candidates, choose_labels};
use crate::error::Result;
use crate::eval::subject::Subject;
use crate::scene::{LabelMap, View};
use crate::scenes::truth::TruthMask;
use std::path::Path;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// The chosen labels, at least one.
    Labels(Vec<u32>),
    /// The prompt works and selects nothing, with the reason.
    Empty(String),
    /// The prompt does not work, with the reason.
    Missing(String),
}

/// Smallest share of the object's strokes that a label must have, so that strokes may slip onto a neighbour.
const STROKE_SHARE_MIN: f64 = 0.05;

pub(super) fn choose(task: &Task, bench: &Bench, subject: &mut dyn Subject) -> Result<Choice> {
    match &task.prompt {
        Prompt::Name => Ok(select_by_name(&task.object, bench)),
        Prompt::Mask(prompt) => {
            let Some(view) = bench.view(&prompt.frame) else { return Ok(no_view(&prompt.frame)) };
            let mask = (bench.truth)(&prompt.file, view)?;
            let map = subject.label_map(&view.camera.resized(mask.width, mask.height), bench.near, bench.compat)?;
            let labels = choose_labels(&map, &mask.inside);
            Ok(if labels.is_empty() { Choice::Empty(why_empty(&map, &mask)) } else { Choice::Labels(labels) })
        }
        Prompt::Scribbles { frame, on, off } => {
            let Some(view) = bench.view(frame) else { return Ok(no_view(frame)) };
            let strokes = |files: &[std::path::PathBuf]| -> Result<Vec<TruthMask>> {
                files.iter().map(|file| (bench.truth)(Path::new(file), view)).collect()
            };
            under_strokes(&strokes(on)?, &strokes(off)?, view, (bench, subject))
        }
    }
}

fn no_view(frame: &str) -> Choice {
    Choice::Missing(format!("the scene has no view {frame}, the view of the prompt"))
}

/// Chooses by name in the label table, or by id.
fn select_by_name(object: &str, bench: &Bench) -> Choice {
    let named = bench.names.and_then(|names| names.id_of(object));
    let Some(id) = named.or_else(|| object.parse().ok()) else {
        return Choice::Missing(format!("labels.json has no label called {object}"));
    };
    if bench.labels.contains(&id) {
        Choice::Labels(vec![id])
    } else {
        Choice::Empty(format!("label {id} has no Gaussian"))
    }
}

fn why_empty(map: &LabelMap, mask: &TruthMask) -> String {
    let near = candidates(map, &mask.inside);
    match near.first() {
        None => "the prompt's mask covers no label".into(),
        Some(best) => format!(
            "no label has more than half of its pixels in the prompt's mask; label {} has {} of {}",
            best.label, best.inside, best.pixels
        ),
    }
}

/// Chooses labels with more pixels under the object's strokes than under other strokes, and a minimum share of the
/// former.
fn under_strokes(
    on: &[TruthMask],
    off: &[TruthMask],
    view: &View,
    (bench, subject): (&Bench, &mut dyn Subject),
) -> Result<Choice> {
    let mut counts = std::collections::BTreeMap::<u32, (u64, u64)>::new();
    for (stroke, wanted) in on.iter().map(|mask| (mask, true)).chain(off.iter().map(|mask| (mask, false))) {
        let map = subject.label_map(&view.camera.resized(stroke.width, stroke.height), bench.near, bench.compat)?;
        for candidate in candidates(&map, &stroke.inside) {
            let (yes, no) = counts.entry(candidate.label).or_default();
            *(if wanted { yes } else { no }) += candidate.inside;
        }
    }
    let all: u64 = counts.values().map(|&(yes, _)| yes).sum();
    let enough = |&(yes, no): &(u64, u64)| yes > no && yes as f64 >= STROKE_SHARE_MIN * all as f64;
    let labels: Vec<u32> = counts.iter().filter(|(_, count)| enough(count)).map(|(&label, _)| label).collect();
    Ok(if labels.is_empty() {
        Choice::Empty("no label has more pixels under the object's strokes than under the other strokes".into())
    } else {
        Choice::Labels(labels)
    })
}
