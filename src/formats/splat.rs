//! The format `.splat`: 32 bytes per Gaussian, without a header. It is read-only, because it cannot store labels or
//! harmonics.

use super::format::{ModelFormat, ReadModel};
use super::rows::{Row, Rows};
use super::values::{log_scale, logit_of_byte};
use labelgs_files::read as file;
use labelgs_scene::harmonics::sh0_of;
use labelgs_scene::{Error, Result};
use std::path::Path;

/// The .splat format.
pub(super) const MODEL_FORMAT: ModelFormat =
    ModelFormat { name: ".splat", extensions: &[".splat"], contents: &[], read, write: None };

/// Bytes per Gaussian: position and size as floats; red, green, blue, opacity and rotation (w, x, y, z) as bytes.
const GAUSSIAN_BYTES: usize = 32;

fn read(path: &Path) -> Result<ReadModel> {
    let bytes = file::bytes(path)?;
    let (rows, odd) = bytes.as_chunks::<GAUSSIAN_BYTES>();
    if !odd.is_empty() || rows.is_empty() {
        let problem = format!(
            "has {} bytes; expected a multiple of {GAUSSIAN_BYTES} above 0; the file was cut short or is not a .splat",
            bytes.len()
        );
        return Err(Error::data(path, format!("byte {}", bytes.len() - odd.len()), problem));
    }
    let mut to = Rows::new(0, false, false);
    for row in rows {
        let float = |at: usize| f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
        to.push(&Row {
            position: [0, 4, 8].map(|at| f64::from(float(at))),
            scale: [12, 16, 20].map(|at| log_scale(float(at))),
            sh0: [24, 25, 26].map(|at| sh0_of(f64::from(row[at]) / 255.0)),
            opacity: logit_of_byte(row[27]),
            quat: [28, 29, 30, 31].map(|at| (f64::from(row[at]) - 128.0) / 128.0),
            ..Row::default()
        });
    }
    to.finish(path, None)
}
