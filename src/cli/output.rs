//! How commands write models.

use crate::io::model::{LabelType, SpzVersion, WriteOptions};
use clap::Args;

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
    /// Returns the choices.
    pub fn options(self) -> WriteOptions {
        WriteOptions { label_type: self.label_type, spz_version: self.spz_version }
    }
}
