//! Preview pictures: photo, render and label map side by side.

use super::history::{Entry, Scored};
use super::{Live, Run, models};
use crate::error::Result;
use crate::eval::metrics::{label_iou, psnr};
use crate::render::Parts;
use std::path::PathBuf;

/// Writes a preview of the current scene. Returns none without a photo.
pub(super) fn write(run: &mut Run) -> Result<Option<PathBuf>> {
    let Some(view) = &run.preview else { return Ok(None) };
    let Some(photo) = &view.photo else { return Ok(None) };
    let photo = photo.get()?;
    let parts = if run.trainer.has_labels() { Parts::LABELS } else { Parts::COLOUR };
    let mut live = Live::new(&mut run.trainer, &mut run.history, &run.dataset, None);
    let rendered = live.render(&view.camera, parts)?;
    let name = format!("{:06}_{}.png", run.trainer.steps_done(), view.stem());
    let path = run.request.output.join("preview").join(name);
    models::save_preview(&path, &photo, &rendered)?;
    // The preview of a stopped run is not on the schedule, which a run that goes on keeps.
    if !run.stopped {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let has_labels = !rendered.labels.is_empty() && run.trainer.config().labels_at(run.trainer.steps_done());
        let mask = if has_labels { view.mask()? } else { None };
        run.history.put(&Entry::Preview(Scored {
            step: run.trainer.steps_done(),
            view: Some(view.name.clone()),
            psnr: finite(psnr(&rendered.rgb, &photo)),
            ssim: None,
            iou: mask.and_then(|mask| label_iou(&rendered.labels, &mask)),
        }));
    }
    Ok(Some(path))
}
