//! Converts the samples of a PNG to source ids, or to black and white.

use crate::error::{Error, Result, Setting};
use crate::io::mask::{Header, Raw, read_raw};
use png::{BitDepth, ColorType};
use std::collections::BTreeSet;
use std::path::Path;

/// The kind of ids in a PNG, from its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Grey8,
    Grey16,
    Palette,
    Rgb,
    /// Transparency or 16-bit colours: no ids.
    Other,
}

impl Kind {
    pub(super) fn of(header: &Header) -> Self {
        match (header.colour, header.depth) {
            (ColorType::Grayscale, BitDepth::Sixteen) => Self::Grey16,
            (ColorType::Grayscale, _) => Self::Grey8,
            (ColorType::Indexed, _) => Self::Palette,
            (ColorType::Rgb, BitDepth::Eight) => Self::Rgb,
            _ => Self::Other,
        }
    }

    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Grey8 => "8-bit grey",
            Self::Grey16 => "16-bit grey",
            Self::Palette => "palette",
            Self::Rgb => "RGB",
            Self::Other => "transparent or 16-bit colour",
        }
    }
}

/// Ids of the source, one per pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SourceIds {
    pub(super) size: (u32, u32),
    pub(super) ids: Vec<u32>,
}

/// Reads ids from a PNG of the kind `expected`: value, index, or R + 256 G + 65536 B.
pub(super) fn read_ids(
    path: &Path,
    expected: Kind,
    accept: impl FnOnce((u32, u32)) -> Result<()>,
) -> Result<SourceIds> {
    let raw = read_raw(path, |header| {
        let found = Kind::of(header);
        if found == expected {
            return accept(header.size);
        }
        let problem = format!(
            "is a {} picture where {} is expected; set {} to what the folder holds",
            found.text(),
            expected.text(),
            Setting("format")
        );
        Err(Error::data(path, "", problem))
    })?;
    let samples = raw.samples();
    let ids = match expected {
        Kind::Rgb => {
            let id = |rgb: &[u16]| u32::from(rgb[0]) + (u32::from(rgb[1]) << 8) + (u32::from(rgb[2]) << 16);
            samples.chunks_exact(3).map(id).collect()
        }
        _ => samples.into_iter().map(u32::from).collect(),
    };
    Ok(SourceIds { size: raw.header.size, ids })
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) size: (u32, u32),
    /// True for pixels of the object, row-major.
    pub(super) inside: Vec<bool>,
    /// Number of distinct values, 0 included if present.
    pub(super) values: usize,
    /// True if the pixels have only one value besides 0, so that no threshold was needed.
    pub(super) sharp: bool,
}

/// Reads a black and white PNG of any kind. If there is one value besides 0, it is the object. If there are more, the
/// object is the upper half of the range, as in the scorers of LERF-Mask.
pub(super) fn read_binary(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<Binary> {
    let raw = read_raw(path, |header| accept(header.size))?;
    let size = raw.header.size;
    let values = brightness(path, &raw)?;
    let distinct: BTreeSet<u16> = values.iter().copied().collect();
    let sharp = distinct.iter().filter(|&&value| value != 0).count() <= 1;
    if !sharp && raw.header.colour == ColorType::Indexed {
        let problem = format!("has {} palette indices, expected two (object and background)", distinct.len());
        return Err(Error::data(path, "", problem));
    }
    let half = (1_u32 << (raw.header.depth as u32)) / 2;
    let inside = |&value: &u16| if sharp { value != 0 } else { u32::from(value) >= half };
    Ok(Binary { size, inside: values.iter().map(inside).collect(), values: distinct.len(), sharp })
}

/// Returns the value of each pixel: grey, index, or the largest of its colours.
fn brightness(path: &Path, raw: &Raw) -> Result<Vec<u16>> {
    let samples = raw.samples();
    let opaque = ((1_u32 << (raw.header.depth as u32)) - 1) as u16;
    let channels = raw.header.colour.samples();
    let alpha = matches!(raw.header.colour, ColorType::GrayscaleAlpha | ColorType::Rgba);
    let pixels = samples.chunks_exact(channels);
    if alpha && pixels.clone().any(|pixel| pixel[channels - 1] != opaque) {
        let problem = "has transparent pixels, which may or may not belong to the object; write black \
                       and white without transparency";
        return Err(Error::data(path, "", problem));
    }
    let colours = channels - usize::from(alpha);
    Ok(pixels.map(|pixel| pixel[..colours].iter().copied().max().unwrap_or(0)).collect())
}
