//! Detects a model that belongs to another scene, or that is in another coordinate frame.

use crate::Result;
use crate::cli::support::args::SceneArgs;
use crate::scene::agreement::{Agreement, Sample};
use crate::scene::colour::to_byte;
use crate::scene::{Dataset, Gaussians, Point, View};
use crate::scenes::{self, LoadOptions};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Opacity from which a Gaussian stands for what is seen.
const OPACITY_MIN: f64 = 0.3;
/// Factor of the first coefficient of colour (3DGS).
const SH_0: f32 = 0.282_094_8;
/// Minimum number of such Gaussians for a verdict.
const GAUSSIANS_MIN: usize = 200;
/// Correlation of the colours of Gaussians and photos below which they do not belong together. Models of their scene
/// have 0.7 to 0.9, others -0.1 to 0.1.
const COLOUR_CORRELATION_MIN: f64 = 0.25;
/// Share of the Gaussians in a photo below which they do not, if there is nothing to compare colours with.
const SHARE_IN_PHOTO_MIN: f64 = 0.01;
/// Photos that are read for a command that needs none, and their longest side, px.
const SAMPLED_PHOTOS_MAX: usize = 4;
const SAMPLED_SIDE_MAX: u32 = 256;

/// Warns if a model and the photos of a scene do not belong together.
pub(crate) fn warn_of_misfit(path: &Path, model: &Gaussians, dataset: &Dataset) -> Result<()> {
    let views: Vec<&View> = dataset.all();
    let opaque: Vec<usize> = (0..model.len()).filter(|&row| model.opacity(row) > OPACITY_MIN).collect();
    let point = |&row: &usize| Point {
        position: model.world(row),
        colour: model.sh0[row].map(|value| to_byte(0.5 + SH_0 * value)),
    };
    let sample = Sample::new(&views, opaque.iter().map(point))?;
    if sample.point_count() < GAUSSIANS_MIN || views.is_empty() {
        return Ok(());
    }
    let found = sample.agreement(|_| ());
    if let Some(why) = misfit(&found) {
        tracing::warn!(
            "{} does not match the photos: {why}. The model belongs to another scene, or is in another coordinate \
             frame (moved, scaled or rotated). Use the model's own scene, or run `labelgs transform` on the model",
            path.display()
        );
    }
    Ok(())
}

/// The same for a command that reads no photos: it reads a few of them, small.
pub(crate) fn warn_of_misfit_with(
    path: &Path,
    model: &Gaussians,
    (scene, reading): (&Path, &SceneArgs),
    dataset: &Dataset,
) -> Result<()> {
    let views = dataset.all();
    let some = views.iter().step_by(views.len().div_ceil(SAMPLED_PHOTOS_MAX).max(1)).map(|view| view.name.clone());
    let only: BTreeSet<String> = some.collect();
    let options = LoadOptions {
        only: Some(Arc::new(only)),
        max_resolution: Some(SAMPLED_SIDE_MAX),
        photo_folder: None,
        ..reading.read.options(LoadOptions::default())
    };
    // The command does not need the photos, so that nothing is said of those that are missing or damaged.
    match scenes::open(scene, &options) {
        Ok(with_photos) => warn_of_misfit(path, model, &with_photos),
        Err(_) => warn_of_misfit(path, model, dataset),
    }
}

/// Returns why a model does not match the photos.
fn misfit(found: &Agreement) -> Option<String> {
    match found.colour {
        Some(colour) if colour < COLOUR_CORRELATION_MIN => {
            let share = 100.0 * found.in_picture;
            Some(format!(
                "a photo shows {share:.0} % of the Gaussians on average, and their colours do not match (correlation \
                 {colour:.2}, usually 0.7 to 0.9)"
            ))
        }
        None if found.in_picture < SHARE_IN_PHOTO_MIN => {
            Some(format!("a photo shows only {:.1} % of the Gaussians on average", 100.0 * found.in_picture))
        }
        _ => None,
    }
}
