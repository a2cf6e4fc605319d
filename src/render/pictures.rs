//! Writes pictures of a view as NAME.WHAT.png or NAME.WHAT.exr.

use super::Render;
use crate::files::image::{write_exr_rgb, write_exr_uint, write_exr_y, write_png_grey16, write_png_rgb8};
use crate::scene::LABEL_MAX;
use crate::scene::colour::to_byte;
use crate::scene::labels::label_colours;
use crate::{Error, Result, Setting};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Largest integer below which 32-bit floats represent every integer.
const FLOAT_EXACT: i32 = 1 << 24;

/// A kind of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum PictureKind {
    /// Colour.
    Rgb,
    /// Mean z per pixel, world units: a grey preview as PNG, the values as EXR.
    Depth,
    /// Opacity, 0 to 1.
    Alpha,
    /// Label ids as 16-bit PNG, with a coloured PNG to look at; ids above 65535 need 32-bit EXR.
    Labels,
    /// Index of the Gaussian with the largest weight, -1 for none; EXR only. With indices above 16777216, the values
    /// are unsigned integers, 4294967295 for none.
    TopId,
    /// Weight of that Gaussian; EXR only.
    TopWeight,
}

/// A file format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Format {
    /// PNG with 8 or 16 bits, clamped to 0..1.
    #[default]
    Png,
    /// EXR with 32-bit floats, not clamped.
    Exr,
}

/// Writes pictures of the view `stem` into `folder`. With `wide_labels`, ids are written as a 32-bit EXR, for models
/// with ids above [`LABEL_MAX`]. Returns the paths of the files.
pub fn write_pictures(
    folder: &Path,
    stem: &str,
    rendered: &Render,
    what: &[PictureKind],
    (format, wide_labels): (Format, bool),
) -> Result<Vec<PathBuf>> {
    let (width, height) = (rendered.width, rendered.height);
    let mut written = Vec::new();
    let mut path = |what: &str, extension: &str| {
        let path = folder.join(format!("{stem}.{what}.{extension}"));
        written.push(path.clone());
        path
    };
    for what in what.iter().copied().collect::<BTreeSet<PictureKind>>() {
        check_size(stem, rendered, what)?;
        match (what, format) {
            (PictureKind::Rgb, Format::Png) => write_rgb(&path("rgb", "png"), (width, height), &rendered.rgb, format)?,
            (PictureKind::Rgb, Format::Exr) => write_rgb(&path("rgb", "exr"), (width, height), &rendered.rgb, format)?,
            (PictureKind::Depth, Format::Png) => {
                write_png_grey16(path("depth", "png"), width, height, &depth_preview(&rendered.depth))?;
            }
            (PictureKind::Depth, Format::Exr) => write_exr_y(path("depth", "exr"), width, height, &rendered.depth)?,
            (PictureKind::Alpha, Format::Png) => {
                let words: Vec<u16> = rendered.alpha.iter().map(|&value| to_word(value)).collect();
                write_png_grey16(path("alpha", "png"), width, height, &words)?;
            }
            (PictureKind::Alpha, Format::Exr) => write_exr_y(path("alpha", "exr"), width, height, &rendered.alpha)?,
            (PictureKind::Labels, _) => {
                let labels = &rendered.labels;
                match narrow(labels, wide_labels, format)? {
                    Some(ids) => write_png_grey16(path("labels", "png"), width, height, &ids)?,
                    None => write_exr_uint(path("labels", "exr"), width, height, labels)?,
                }
                write_png_rgb8(path("labels-colour", "png"), width, height, &label_colours(labels))?;
            }
            (PictureKind::TopId, _) => write_rows(&path("top-id", "exr"), (width, height), &rendered.top_id)?,
            (PictureKind::TopWeight, _) => write_exr_y(path("top-weight", "exr"), width, height, &rendered.top_weight)?,
        }
    }
    Ok(written)
}

/// Returns ids for a 16-bit PNG, or `None` if they go into an EXR.
fn narrow(labels: &[u32], wide: bool, format: Format) -> Result<Option<Vec<u16>>> {
    match (wide, format) {
        (true, Format::Exr) => Ok(None),
        (true, Format::Png) => {
            let problem =
                format!("a 16-bit PNG cannot hold labels above {LABEL_MAX}; choose exr, or give them smaller ids");
            Err(Error::usage(Setting("format"), problem))
        }
        (false, _) => {
            let id = |&id: &u32| u16::try_from(id).map_err(|_| Error::Bug(format!("label {id} in a 16-bit picture")));
            labels.iter().map(id).collect::<Result<_>>().map(Some)
        }
    }
}

/// Returns the colours of a video frame; fails for kinds that are not colours. Depth is grey between two bounds, which
/// the first frame with depth sets, so that surfaces do not flicker.
#[cfg(feature = "cli")]
pub(crate) fn frame(rendered: &Render, what: PictureKind, depths: &mut Option<[f32; 2]>) -> Result<Vec<[u8; 3]>> {
    check_size("a video", rendered, what)?;
    Ok(match what {
        PictureKind::Rgb => rendered.rgb.iter().map(|colour| colour.map(to_byte)).collect(),
        PictureKind::Alpha => rendered.alpha.iter().map(|&alpha| [to_byte(alpha); 3]).collect(),
        PictureKind::Labels => label_colours(&rendered.labels),
        PictureKind::Depth => {
            let range = depth_range(&rendered.depth);
            let range = *depths.get_or_insert(range);
            *depths = depths.filter(|[_, far]| *far > 0.0);
            depth_grey(&rendered.depth, range).into_iter().map(|grey| [(grey >> 8) as u8; 3]).collect()
        }
        PictureKind::TopId | PictureKind::TopWeight => {
            return Err(Error::Bug("a video of rows of the model".to_owned()));
        }
    })
}

/// Writes rows, as floats if these represent them exactly, else as unsigned integers with 4294967295 for none.
fn write_rows(path: &Path, (width, height): (u32, u32), rows: &[i32]) -> Result<()> {
    if rows.iter().all(|&row| row <= FLOAT_EXACT) {
        let values: Vec<f32> = rows.iter().map(|&row| row as f32).collect();
        return write_exr_y(path, width, height, &values);
    }
    write_exr_uint(path, width, height, bytemuck::cast_slice(rows))
}

/// Writes colours, row-major; a PNG clamps them to 0..1.
pub fn write_rgb(path: &Path, (width, height): (u32, u32), rgb: &[[f32; 3]], format: Format) -> Result<()> {
    match format {
        Format::Exr => write_exr_rgb(path, width, height, rgb),
        Format::Png => {
            let bytes: Vec<[u8; 3]> = rgb.iter().map(|colour| colour.map(to_byte)).collect();
            write_png_rgb8(path, width, height, &bytes)
        }
    }
}

fn check_size(stem: &str, rendered: &Render, what: PictureKind) -> Result<()> {
    let pixels = rendered.width as usize * rendered.height as usize;
    let length = match what {
        PictureKind::Rgb => rendered.rgb.len(),
        PictureKind::Depth => rendered.depth.len(),
        PictureKind::Alpha => rendered.alpha.len(),
        PictureKind::Labels => rendered.labels.len(),
        PictureKind::TopId => rendered.top_id.len(),
        PictureKind::TopWeight => rendered.top_weight.len(),
    };
    if length == pixels {
        return Ok(());
    }
    Err(Error::Bug(format!("a picture of {stem} has {length} pixels instead of {pixels}")))
}

/// Converts a value from 0 to 1 to 16 bits.
pub(crate) fn to_word(value: f32) -> u16 {
    (value.clamp(0.0, 1.0) * 65_535.0).round() as u16
}

/// Returns the nearest and the farthest depth; infinity and 0 if there is none.
pub(crate) fn depth_range(depth: &[f32]) -> [f32; 2] {
    let there = depth.iter().copied().filter(|z| is_depth(*z));
    there.fold([f32::INFINITY, 0.0], |[near, far], z| [near.min(z), far.max(z)])
}

fn is_depth(z: f32) -> bool {
    z.is_finite() && z > 0.0
}

/// Converts depth to grey: near is bright, far is dark, holes are black.
pub(crate) fn depth_preview(depth: &[f32]) -> Vec<u16> {
    depth_grey(depth, depth_range(depth))
}

/// Same as [`depth_preview`], between two bounds.
fn depth_grey(depth: &[f32], [near, far]: [f32; 2]) -> Vec<u16> {
    let grey = |z: f32| if far > near { 1.0 - 0.9 * (z - near) / (far - near) } else { 1.0 };
    depth.iter().map(|z| if is_depth(*z) { to_word(grey(*z)) } else { 0 }).collect()
}
