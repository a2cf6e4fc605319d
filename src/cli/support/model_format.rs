//! How commands write models.

use crate::Result;
use crate::formats::{FirstView, LabelType, SpzVersion, WriteOptions, is_page};
use crate::scene::Overview;
use crate::scenes::camera_json::views_of_model;
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
    /// Returns the choices for the file `output` made of `model`. The cameras of the model's run tell a page where to look
    /// from at first.
    pub(crate) fn options(self, model: &Path, output: &Path) -> Result<WriteOptions> {
        let views = if is_page(output) { views_of_model(model)? } else { Vec::new() };
        let all = Overview::of(views.iter().map(|view| &view.camera));
        let first_view = all.zip(views.first()).map(|(all, view)| FirstView { up: all.up, eye: view.camera.centre() });
        Ok(WriteOptions { label_type: self.label_type, spz_version: self.spz_version, first_view })
    }
}
