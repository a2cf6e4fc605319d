//! Preview pictures: photo, render and label map side by side.

use super::history::{Entry, ViewScore};
use super::{Event, LiveScene, Run, models};
use crate::error::Result;
use crate::eval::metrics::{label_iou, psnr};
use crate::eval::target::Target;
use crate::render::Parts;
use crate::train::between::StepJob;
use std::path::PathBuf;
use std::time::Instant;

/// Writes a preview.
pub(super) struct PreviewJob;

impl StepJob<Run<'_>> for PreviewJob {
    fn is_due(&self, step: u32, run: &Run) -> bool {
        step < run.settings.train.iterations && run.settings.run.preview_every.is_due(step, run.previewed)
    }

    fn run(&mut self, step: u32, run: &mut Run) -> Result<()> {
        run.previewed = Instant::now();
        let written = write(run);
        match run.tolerate(written)?.flatten() {
            Some(path) => run.tell(Event::Preview { step, path: &path }),
            None => Ok(()),
        }
    }
}

/// Writes a preview of the current scene. Returns `None` without a photo.
pub(super) fn write(run: &mut Run) -> Result<Option<PathBuf>> {
    let Some(view) = &run.preview else { return Ok(None) };
    if view.photo.is_none() {
        return Ok(None);
    }
    let target = Target::for_view(view, run.trainer.render_options().background)?;
    let parts = if run.trainer.has_labels() { Parts::LABELS } else { Parts::COLOUR };
    let mut live = LiveScene::new(&mut run.trainer, &mut run.history, &run.dataset, None);
    let rendered = live.render(&view.camera, parts)?;
    let name = format!("{:06}_{}.png", run.trainer.steps_done(), view.stem());
    let path = run.request.output.join("preview").join(name);
    models::save_preview(&path, &target.photo, &rendered)?;
    // A stopped run's preview is not part of the schedule, which a resumed run continues.
    if !run.stopped {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let has_labels = !rendered.labels.is_empty() && run.trainer.config().labels_at(run.trainer.steps_done());
        let mask = if has_labels { view.mask()? } else { None };
        run.history.put(&Entry::Preview(ViewScore {
            step: run.trainer.steps_done(),
            view: Some(view.name.clone()),
            psnr: finite(psnr(&rendered.rgb, target.coloured())),
            ssim: None,
            iou: mask.and_then(|mask| label_iou(&rendered.labels, &mask)),
        }));
    }
    Ok(Some(path))
}
