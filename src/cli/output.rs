//! How commands write models.

use crate::Result;
use crate::io::camera_json::views_of_model;
use crate::io::model::{LabelType, Sight, SpzVersion, WriteOptions};
use crate::scene::Overview;
use clap::Args;
use std::path::Path;

/// Choices for files of models.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Output")]
pub struct WriteArgs {
    /// How labels are written: as floats in a PLY, as unsigned integers in a PLY, or not at all. Some programs refuse or
    /// misread a PLY with integers.
    #[arg(long, value_name = "TYPE", value_enum, default_value = "float")]
    pub label_type: LabelType,
    /// Version of SPZ files: 3 is read by most viewers, 4 is smaller.
    #[arg(long, value_name = "VERSION", value_enum, default_value = "3")]
    pub spz_version: SpzVersion,
}

impl WriteArgs {
    /// Returns the choices for a file made of `model`, whose cameras tell a page where to look from.
    pub(crate) fn options(self, model: &Path) -> Result<WriteOptions> {
        let views = views_of_model(model)?;
        let up = Overview::of(views.iter().map(|view| &view.camera));
        let sight = up.zip(views.first()).map(|(all, view)| Sight { up: all.up, eye: view.camera.centre() });
        Ok(WriteOptions { label_type: self.label_type, spz_version: self.spz_version, sight })
    }
}
