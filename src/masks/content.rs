//! Converts the samples of a PNG to source ids, or to black and white.

use super::mask::{Header, RawPng, read_raw};
use labelgs_scene::{Error, Result, Setting};
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
    /// 16-bit colours, which cannot be ids.
    Rgb16,
}

impl Kind {
    /// Ignores opacity. Colours may still be grey, which only their pixels show.
    pub(super) fn from_header(header: &Header) -> Self {
        match (header.colour, header.depth) {
            (ColorType::Indexed, _) => Self::Palette,
            (ColorType::Rgb | ColorType::Rgba, BitDepth::Sixteen) => Self::Rgb16,
            (ColorType::Rgb | ColorType::Rgba, _) => Self::Rgb,
            (_, BitDepth::Sixteen) => Self::Grey16,
            _ => Self::Grey8,
        }
    }

    /// Returns the kind of a colour image whose channels are all equal.
    pub(super) fn as_grey(self) -> Self {
        match self {
            Self::Rgb => Self::Grey8,
            Self::Rgb16 => Self::Grey16,
            other => other,
        }
    }

    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Grey8 => "8-bit grey",
            Self::Grey16 => "16-bit grey",
            Self::Palette => "palette",
            Self::Rgb => "RGB",
            Self::Rgb16 => "16-bit RGB",
        }
    }
}

/// Returns true if the image has one value per pixel, whatever its channels.
pub(super) fn is_grey(path: &Path) -> Result<bool> {
    Ok(read_raw(path, |_| Ok(()))?.values(path)?.is_some())
}

/// Reads the size and the ids of a PNG of kind `expected`, one per pixel: value, index, or R + 256 G + 65536 B.
pub(super) fn read_ids(
    path: &Path,
    expected: Kind,
    accept: impl FnOnce((u32, u32)) -> Result<()>,
) -> Result<((u32, u32), Vec<u32>)> {
    let wrong = |found: Kind| {
        let problem = format!(
            "is a {} image where {} is expected; set {} to the format of the folder",
            found.text(),
            expected.text(),
            Setting("format")
        );
        Error::data(path, "", problem)
    };
    let raw = read_raw(path, |header| match Kind::from_header(header) {
        found if found == expected || found.as_grey() == expected => accept(header.size),
        found => Err(wrong(found)),
    })?;
    let ids = if expected == Kind::Rgb {
        let id = |rgb: &[u16]| u32::from(rgb[0]) + (u32::from(rgb[1]) << 8) + (u32::from(rgb[2]) << 16);
        raw.opaque(path)?.0.chunks_exact(3).map(id).collect()
    } else {
        let values = raw.values(path)?.ok_or_else(|| wrong(Kind::from_header(&raw.header)))?;
        values.into_iter().map(u32::from).collect()
    };
    Ok((raw.header.size, ids))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) size: (u32, u32),
    /// True for pixels of the object, row-major.
    pub(super) inside: Vec<bool>,
    /// Whether the pixels have a single value besides 0, so that no threshold was needed.
    pub(super) sharp: bool,
}

/// Reads a black and white PNG of any kind. A single value besides 0 is the object. With more values, the object is the
/// upper half of the range, as in the LERF-Mask scorers.
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
    Ok(Binary { size, inside: values.iter().map(inside).collect(), sharp })
}

/// Returns the value of each pixel: grey, index, or its largest colour channel.
fn brightness(path: &Path, raw: &RawPng) -> Result<Vec<u16>> {
    let (samples, channels) = raw.opaque(path)?;
    Ok(samples.chunks_exact(channels).map(|pixel| pixel.iter().copied().max().unwrap_or(0)).collect())
}
