//! The evaluation of the LabelGS paper.
//!
//! `segmentations/FRAME/OBJECT.png`, white where the object is visible. The first frame by name is a training view and
//! the prompt; the other frames are scored. The first frame is left out even if labels are chosen by name, because the
//! model was trained on it.

use super::{Ask, By, Layout, by_frame_and_object, tasks};
use std::path::PathBuf;

pub(super) fn layout(files: &[PathBuf], ask: Ask) -> Result<Layout, String> {
    let mut left_out = Vec::new();
    let objects = by_frame_and_object(files, &mut left_out);
    let frames: std::collections::BTreeSet<&str> =
        objects.values().flatten().map(|truth| truth.frame.as_str()).collect();
    let Some(first) = frames.first().map(|&first| first.to_owned()) else {
        return Err("holds no mask; expected FRAME/OBJECT.png".into());
    };
    let mut layout = tasks(objects, ask);
    if ask.by == By::Name {
        layout.tasks.iter_mut().for_each(|task| task.truths.retain(|truth| truth.frame != first));
    }
    layout.left_out.extend(left_out);
    Ok(layout)
}
