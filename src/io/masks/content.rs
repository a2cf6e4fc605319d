//! From the samples of a PNG to source ids, or to black and white.

use crate::error::{Error, Result};
use crate::io::mask::{Header, Raw, read_raw};
use png::{BitDepth, ColorType};
use std::collections::BTreeSet;
use std::path::Path;

/// What ids a PNG can hold, by its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Grey of up to 8 bits.
    Grey8,
    /// Grey of 16 bits.
    Grey16,
    /// Indices.
    Palette,
    /// Three bytes.
    Rgb,
    /// Anything with transparency or 16-bit colours: never ids.
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

/// An id per pixel as the source numbers them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SourceIds {
    pub(super) size: (u32, u32),
    pub(super) ids: Vec<u32>,
}

/// Reads ids from a PNG of the kind `expected`: its value or index, or R + 256 G + 65536 B.
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
            "is a {} picture where {} is expected; set `format` to what the folder holds",
            found.text(),
            expected.text()
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

/// A black and white mask.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) size: (u32, u32),
    /// Pixels of the object.
    pub(super) inside: Vec<bool>,
    /// Different values of its pixels, 0 among them or not.
    pub(super) values: usize,
    /// True if the pixels have one value besides 0, so that nothing had to be cut.
    pub(super) sharp: bool,
}

/// Reads a black and white PNG of any kind. With one value besides 0, that is the object; with more, the upper half
/// of the range is, as the scorers of LERF-Mask cut it.
pub(super) fn read_binary(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<Binary> {
    let raw = read_raw(path, |header| accept(header.size))?;
    let size = raw.header.size;
    let values = brightness(path, &raw)?;
    let distinct: BTreeSet<u16> = values.iter().copied().collect();
    let sharp = distinct.iter().filter(|&&value| value != 0).count() <= 1;
    if !sharp && raw.header.colour == ColorType::Indexed {
        let problem = format!("has {} palette indices where an object and its surroundings make two", distinct.len());
        return Err(Error::data(path, "", problem));
    }
    let half = (1_u32 << (raw.header.depth as u32)) / 2;
    let inside = |&value: &u16| if sharp { value != 0 } else { u32::from(value) >= half };
    Ok(Binary { size, inside: values.iter().map(inside).collect(), values: distinct.len(), sharp })
}

/// The value of each pixel: grey, index, or the largest of its colours.
fn brightness(path: &Path, raw: &Raw) -> Result<Vec<u16>> {
    let samples = raw.samples();
    let opaque = ((1_u32 << (raw.header.depth as u32)) - 1) as u16;
    let channels = raw.header.colour.samples();
    let alpha = matches!(raw.header.colour, ColorType::GrayscaleAlpha | ColorType::Rgba);
    let pixels = samples.chunks_exact(channels);
    if alpha && pixels.clone().any(|pixel| pixel[channels - 1] != opaque) {
        let problem = "is transparent in places, and whether those belong to the object cannot be known; write black \
                       and white without transparency";
        return Err(Error::data(path, "", problem));
    }
    let colours = channels - usize::from(alpha);
    Ok(pixels.map(|pixel| pixel[..colours].iter().copied().max().unwrap_or(0)).collect())
}
