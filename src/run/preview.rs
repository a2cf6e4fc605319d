//! Preview pictures: photo, render and label map side by side.

use super::{Live, Run, models};
use crate::error::Result;
use crate::render::Parts;
use std::path::PathBuf;

/// Writes a preview of the current scene. Returns none without a photo.
pub(super) fn write(run: &mut Run) -> Result<Option<PathBuf>> {
    let Some(view) = &run.preview else { return Ok(None) };
    let Some(photo) = &view.photo else { return Ok(None) };
    let parts = if run.trainer.has_labels() { Parts::LABELS } else { Parts::COLOUR };
    let rendered = Live::new(&mut run.trainer, &run.dataset, None).render(&view.camera, parts)?;
    let name = format!("{:06}_{}.png", run.trainer.steps_done(), view.stem());
    let path = run.request.output.join("preview").join(name);
    models::save_preview(&path, photo, &rendered)?;
    Ok(Some(path))
}
