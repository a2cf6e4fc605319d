//! Files with one depth map: 16-bit PNG, EXR, NPY or PFM. Values stay as stored.

use super::image::{PIXELS_MAX, check_length, check_png_length, check_size};
use crate::error::{Error, Result};
use crate::io::read;
use crate::scene::DepthMap;
use exr::prelude::{MetaData, ReadChannels, ReadLayers};
use std::io::Cursor;
use std::path::Path;

/// Extensions of depth files in order of preference. PNG is last, because it is often only a picture of the other file.
pub(crate) const EXTENSIONS: [&str; 4] = ["exr", "npy", "pfm", "png"];

/// Reads a depth map; the extension gives the format.
pub(crate) fn read_depth(path: &Path) -> Result<DepthMap> {
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
        // The crate chooses the layer and takes memory for all its channels.
        let (size, channels) = ((side(header.layer_size.x()), side(header.layer_size.y())), header.channels.list.len());
        check_size(path, size)?;
        check_length(path, size, channels as u64)?;
        samples += u64::from(size.0) * u64::from(size.1) * channels as u64;
        first = first.or(Some(size));
    }
    if samples > PIXELS_MAX {
        return Err(refuse(&format!("{samples} samples in all channels; up to {PIXELS_MAX} are supported")));
    }
    let Some((width, height)) = first else { return Err(refuse(&"it has no picture")) };
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
        return Err(refuse(&"the channel has another size than its picture"));
    }
    Ok(DepthMap { width, height, values })
}

/// Reads a two-dimensional array of floats in C order, `[height, width]`. Format of numpy, versions 1 to 3: magic,
/// version, header length, a Python dictionary with three keys, the values.
fn read_npy(path: &Path) -> Result<DepthMap> {
    let refuse = refuse(path, "NPY");
    let bytes = read::bytes(path)?;
    let parts = || {
        let rest = bytes.strip_prefix(b"\x93NUMPY")?;
        let (start, length) = match *rest.first()? {
            1 => (4_usize, usize::from(u16::from_le_bytes([*rest.get(2)?, *rest.get(3)?]))),
            2 | 3 => (6, u32::from_le_bytes([*rest.get(2)?, *rest.get(3)?, *rest.get(4)?, *rest.get(5)?]) as usize),
            _ => return None,
        };
        Some((std::str::from_utf8(rest.get(start..start.checked_add(length)?)?).ok()?, &rest[start + length..]))
    };
    let (header, data) = parts().ok_or_else(|| refuse(&"its header is not numpy's"))?;
    let field = |key: &str| {
        let (_, value) = header.split_once(&format!("'{key}':"))?;
        Some(value.trim_start())
    };
    let no = |key: &str| refuse(&format!("its header has no {key}"));
    let shape = field("shape").and_then(|text| text.strip_prefix('(')?.split_once(')')).ok_or_else(|| no("shape"))?.0;
    let sides: Vec<&str> = shape.split(',').map(str::trim).filter(|side| !side.is_empty()).collect();
    let &[height, width] = sides.as_slice() else {
        return Err(Error::data(path, "shape", format!("is ({shape}); expected (height, width)")));
    };
    if !field("fortran_order").ok_or_else(|| no("fortran_order"))?.starts_with("False") {
        let cure = "the array is in Fortran order; save numpy.ascontiguousarray(depth)";
        return Err(Error::data(path, "fortran_order", cure));
    }
    let side = |side: &str| side.parse().map_err(|_| no("shape of whole numbers"));
    let (width, height) = (side(width)?, side(height)?);
    check_size(path, (width, height))?;
    let kind = field("descr").ok_or_else(|| no("descr"))?;
    let kind = kind.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let (little, each) = match kind {
        "<f2" | "<f4" | "<f8" => (true, usize::from(kind.as_bytes()[2] - b'0')),
        ">f2" | ">f4" | ">f8" => (false, usize::from(kind.as_bytes()[2] - b'0')),
        _ => return Err(Error::data(path, "descr", format!("is {kind}; depth is float16, float32 or float64"))),
    };
    let pixels = width as usize * height as usize;
    if data.len() != pixels * each {
        return Err(refuse(&format!("{pixels} numbers need {} bytes, it has {}", pixels * each, data.len())));
    }
    let value = |number: &[u8]| {
        let mut eight = [0_u8; 8];
        eight[..each].copy_from_slice(number);
        if !little {
            eight[..each].reverse();
        }
        match each {
            2 => half::f16::from_le_bytes([eight[0], eight[1]]).to_f32(),
            4 => f32::from_le_bytes([eight[0], eight[1], eight[2], eight[3]]),
            _ => f64::from_le_bytes(eight) as f32,
        }
    };
    Ok(DepthMap { width, height, values: data.chunks_exact(each).map(value).collect() })
}

/// Reads a PFM: `Pf`, width and height, scale (negative for little-endian), then rows from bottom to top.
fn read_pfm(path: &Path) -> Result<DepthMap> {
    let refuse = refuse(path, "PFM");
    let bytes = read::bytes(path)?;
    let mut at = 0;
    let mut word = || {
        let start = at + bytes[at..].iter().position(|byte| !byte.is_ascii_whitespace())?;
        let end = start + bytes[start..].iter().take(32).position(u8::is_ascii_whitespace)?;
        // A word ends at one white space. After the scale this is the last byte of the header.
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
