//! Depth map files: 16-bit PNG, EXR, NPY or PFM. Values stay as stored.

use super::image::{PIXELS_MAX, check_length, check_png_length, check_size};
use super::{npy, read};
use exr::prelude::{MetaData, ReadChannels, ReadLayers};
use labelgs_scene::{DepthMap, Error, Result};
use std::io::Cursor;
use std::path::Path;

/// Extensions of depth files in order of preference. PNG comes last, because it is often only a picture of another
/// file.
pub const DEPTH_EXTENSIONS: [&str; 4] = ["exr", "npy", "pfm", "png"];

/// Reads a depth map; the extension gives the format.
pub fn read_depth(path: &Path) -> Result<DepthMap> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "png" => read_png(path),
        "exr" => read_exr(path),
        "npy" => read_npy(path),
        "pfm" => read_pfm(path),
        _ => Err(Error::data(path, "", "is not a depth file; expected 16-bit grey .png, .exr, .npy or .pfm")),
    }
}

fn refuse(path: &Path, kind: &str) -> impl Fn(&dyn std::fmt::Display) -> Error {
    let prefix = format!("is not a readable {kind} depth map: ");
    move |cause| Error::data(path, "", format!("{prefix}{cause}"))
}

fn read_png(path: &Path) -> Result<DepthMap> {
    let refuse = refuse(path, "PNG");
    let mut reader = png::Decoder::new(Cursor::new(read::bytes(path)?)).read_info().map_err(|error| refuse(&error))?;
    let (width, height) = (reader.info().width, reader.info().height);
    check_size(path, (width, height))?;
    let (colour, bits) = (reader.info().color_type, reader.info().bit_depth);
    if (colour, bits) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        let problem = format!(
            "is {colour:?} with {} bits; depth needs 16-bit grey, because 8 bits are too coarse. \
             Write .npy, .exr, .pfm or 16-bit PNG",
            bits as u8
        );
        return Err(Error::data(path, "", problem));
    }
    check_png_length(path, (width, height), 16)?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or_else(|| refuse(&"too large"))?];
    reader.next_frame(&mut bytes).map_err(|error| refuse(&error))?;
    let values = bytes.chunks_exact(2).map(|pair| f32::from(u16::from_be_bytes([pair[0], pair[1]]))).collect();
    Ok(DepthMap { width, height, values })
}

/// Reads the only channel of the first layer, or the one named Y, Z or R.
fn read_exr(path: &Path) -> Result<DepthMap> {
    let refuse = refuse(path, "EXR");
    let bytes = read::bytes(path)?;
    let header = MetaData::read_from_buffered(Cursor::new(&bytes), false).map_err(|error| refuse(&error))?;
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let (mut samples, mut first) = (0, None);
    for header in &header.headers {
        // The crate chooses the layer and allocates memory for all its channels.
        let (size, channels) = ((side(header.layer_size.x()), side(header.layer_size.y())), header.channels.list.len());
        check_size(path, size)?;
        check_length(path, size, channels as u64)?;
        samples += u64::from(size.0) * u64::from(size.1) * channels as u64;
        first = first.or(Some(size));
    }
    if samples > PIXELS_MAX {
        return Err(refuse(&format!("{samples} samples in all channels; up to {PIXELS_MAX} are supported")));
    }
    let Some((width, height)) = first else { return Err(refuse(&"it has no image")) };
    let layer = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = layer.all_attributes().from_buffered(Cursor::new(&bytes)).map_err(|error| refuse(&error))?;
    let channels = &image.layer_data.channel_data.list;
    let named = |name: &str| channels.iter().find(|channel| channel.name.eq(name));
    let channel = match channels.as_slice() {
        [only] => Some(only),
        _ => ["Y", "Z", "R"].into_iter().find_map(named),
    };
    let Some(channel) = channel else {
        return Err(Error::data(path, "channels", "has no channel named Y, Z or R; depth has one channel"));
    };
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    if values.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(refuse(&"the channel and its image differ in size"));
    }
    Ok(DepthMap { width, height, values })
}

/// Reads a two-dimensional array of floats, `[height, width]`.
fn read_npy(path: &Path) -> Result<DepthMap> {
    let ([height, width], values) = npy::read::<2>(path, "depth map", "(height, width)")?;
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let (width, height) = (side(width), side(height));
    check_size(path, (width, height))?;
    Ok(DepthMap { width, height, values: values.into_iter().map(|value| value as f32).collect() })
}

/// Reads a PFM: `Pf`, width and height, scale (negative for little-endian), then rows from bottom to top.
fn read_pfm(path: &Path) -> Result<DepthMap> {
    let refuse = refuse(path, "PFM");
    let bytes = read::bytes(path)?;
    let mut at = 0;
    let mut word = || {
        let start = at + bytes[at..].iter().position(|byte| !byte.is_ascii_whitespace())?;
        let end = start + bytes[start..].iter().take(32).position(u8::is_ascii_whitespace)?;
        // A word ends at a single white space. After the scale, that is the last byte of the header.
        at = end + 1;
        std::str::from_utf8(&bytes[start..end]).ok()
    };
    match word() {
        Some("Pf") => {}
        Some("PF") => return Err(Error::data(path, "", "is a colour PFM; depth needs grey, `Pf`")),
        _ => return Err(refuse(&"it does not start with `Pf`")),
    }
    let mut number = |what: &str| {
        word().and_then(|word| word.parse::<f64>().ok()).ok_or_else(|| refuse(&format!("its header has no {what}")))
    };
    let (width, height, scale) = (number("width")?, number("height")?, number("scale")?);
    if [width, height].iter().any(|side| side.fract() != 0.0) || !scale.is_finite() || scale == 0.0 {
        return Err(refuse(&format!(
            "{width} x {height} px with the scale {scale}; sides must be whole, the scale not 0"
        )));
    }
    let (width, height) = (width as u32, height as u32);
    check_size(path, (width, height))?;
    let (row, expected) = (width as usize * 4, width as usize * height as usize * 4);
    let numbers = &bytes[at.min(bytes.len())..];
    if numbers.len() != expected {
        return Err(refuse(&format!("{width} x {height} px need {expected} bytes, it has {}", numbers.len())));
    }
    let float = |four: &[u8]| {
        let four = [four[0], four[1], four[2], four[3]];
        if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) }
    };
    let values = numbers.chunks_exact(row).rev().flat_map(|row| row.chunks_exact(4).map(float)).collect();
    Ok(DepthMap { width, height, values })
}
