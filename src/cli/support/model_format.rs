//! How commands write models.

use crate::Result;
use crate::formats::{LabelType, SpzVersion, WriteOptions, is_page};
use crate::render::portrait::best_camera;
use crate::run::models::first_view;
use crate::scene::{Camera, Gaussians};
use crate::scenes::camera_json::views_of_model;
use clap::Args;
use std::path::Path;

/// Choices for files of models.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Output")]
pub struct WriteArgs {
    /// Type of the labels in a PLY file, or none to write no labels.
    #[arg(long, value_name = "TYPE", value_enum, default_value = "float")]
    pub label_type: LabelType,
    /// SPZ version: most viewers read 3; 4 is smaller.
    #[arg(long, value_name = "VERSION", value_enum, default_value = "3")]
    pub spz_version: SpzVersion,
}

impl WriteArgs {
    /// Returns the choices for the file `output` made of `model`. It is seen from at first where the model is.
    pub(crate) fn options(self, model: &Path, output: &Path) -> Result<WriteOptions> {
        let first_view = match first_view(model) {
            // It is what a page is for; other files are as good without it.
            Err(error) if !is_page(output) => {
                tracing::warn!("{error}; the file will have no initial view");
                None
            }
            found => found?,
        };
        Ok(WriteOptions { label_type: self.label_type, spz_version: self.spz_version, first_view })
    }

    /// Returns the choices for a file with `part` of `model` alone. It is seen at first from the camera of the model's
    /// run that shows it best.
    pub(crate) fn options_of_part(self, model: &Path, output: &Path, part: &Gaussians) -> Result<WriteOptions> {
        let mut options = self.options(model, output)?;
        // `options` has reported damaged cameras.
        let views = views_of_model(model).unwrap_or_default();
        let cameras: Vec<&Camera> = views.iter().map(|view| &view.camera).collect();
        if let (Some(view), Some(best)) = (&mut options.first_view, best_camera(part, &cameras)) {
            view.eye = best.centre();
        }
        Ok(options)
    }
}
