//! Finds the Gaussians that strokes over photos hit.

use crate::edit::strokes::{Seed, Stroke, stroke_title};
use crate::engine::{Engine, EngineSize};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::render::{RenderOptions, render};
use crate::scene::{Gaussians, View};
use crate::scheduler::SchedulerOptions;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Strokes ignore Gaussians below this opacity wherever they also hit more opaque ones.
const OPACITY_MIN: f64 = 0.25;

/// Returns the main Gaussians of the pixels of each stroke, in the order of the strokes. `file` is their source, for
/// messages.
///
/// # Errors
///
/// A stroke leaves its photo, or hits no Gaussian; the message has its number, from 1.
pub fn seeds(
    gpu: Arc<Gpu>,
    model: &Gaussians,
    strokes: &[(&Stroke, &View)],
    near: f32,
    file: &Path,
) -> Result<Vec<Seed>> {
    let sizes = strokes.iter().map(|(_, view)| view.camera.size());
    let mut engine = Engine::new(gpu, EngineSize::for_model(model, sizes), SchedulerOptions::default())?;
    engine.upload_model(model)?;
    let (mut shown, mut seeds) = (BTreeMap::<&str, Vec<i32>>::new(), Vec::new());
    for (number, &(stroke, view)) in (1..).zip(strokes) {
        if !shown.contains_key(view.name.as_str()) {
            let rendered = render(&mut engine, &view.camera, &RenderOptions::for_main(near))?;
            shown.insert(&view.name, rendered.top_id);
        }
        let wrong = |problem: String| Error::data(file, stroke_title(number), problem);
        let pixels =
            stroke.pixels(view.camera.size()).map_err(|problem| wrong(format!("{problem} ({})", view.name)))?;
        let top = &shown[view.name.as_str()];
        let mut rows: Vec<usize> = pixels.iter().filter_map(|&pixel| usize::try_from(top[pixel]).ok()).collect();
        let is_solid = |row: usize| model.opacity(row) >= OPACITY_MIN;
        if rows.iter().any(|&row| is_solid(row)) {
            rows.retain(|&row| is_solid(row));
        }
        rows.sort_unstable();
        rows.dedup();
        if rows.is_empty() {
            let problem =
                format!("hits nothing of the model in {}; draw it where the model shows something", view.name);
            return Err(wrong(problem));
        }
        seeds.extend(rows.into_iter().map(|row| Seed { row, label: stroke.label, is_on: stroke.on }));
    }
    Ok(seeds)
}
