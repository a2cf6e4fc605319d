//! NPY files: one array of floats in C order. Format of numpy, versions 1 to 3: magic, version, header length, a Python
//! dictionary with three keys, the values.

use super::image::PIXELS_MAX;
use super::read;
use labelgs_scene::{Error, Result};
use std::path::Path;

/// Reads an array of `N` dimensions: its shape and values. In messages, `what` names the content and `axes` the
/// expected shape.
pub fn read<const N: usize>(path: &Path, what: &str, axes: &str) -> Result<([usize; N], Vec<f64>)> {
    let refuse = |cause: &str| Error::data(path, "", format!("is not a readable NPY {what}: {cause}"));
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
    let (header, data) = parts().ok_or_else(|| refuse("its header is not numpy's"))?;
    let field = |key: &str| {
        let (_, value) = header.split_once(&format!("'{key}':"))?;
        Some(value.trim_start())
    };
    let no = |key: &str| refuse(&format!("its header has no {key}"));
    let text = field("shape").and_then(|text| text.strip_prefix('(')?.split_once(')')).ok_or_else(|| no("shape"))?.0;
    let sides: Vec<&str> = text.split(',').map(str::trim).filter(|side| !side.is_empty()).collect();
    let sides: [&str; N] =
        sides.try_into().map_err(|_| Error::data(path, "shape", format!("is ({text}); expected {axes}")))?;
    let mut shape = [0; N];
    for (side, text) in shape.iter_mut().zip(sides) {
        *side = text.parse().map_err(|_| no("shape of whole numbers"))?;
    }
    if !field("fortran_order").ok_or_else(|| no("fortran_order"))?.starts_with("False") {
        let cure = "the array is in Fortran order; save numpy.ascontiguousarray of it";
        return Err(Error::data(path, "fortran_order", cure));
    }
    let count = shape.iter().try_fold(1_usize, |product, &side| product.checked_mul(side));
    let Some(count) = count.filter(|&count| count > 0 && count as u64 <= PIXELS_MAX) else {
        let sides = shape.map(|side| side.to_string()).join(" x ");
        return Err(Error::data(path, "shape", format!("is {sides}; from 1 to {PIXELS_MAX} numbers are supported")));
    };
    let kind = field("descr").ok_or_else(|| no("descr"))?;
    let kind = kind.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let (little, each) = match kind {
        "<f2" | "<f4" | "<f8" => (true, usize::from(kind.as_bytes()[2] - b'0')),
        ">f2" | ">f4" | ">f8" => (false, usize::from(kind.as_bytes()[2] - b'0')),
        _ => {
            let problem = format!("is {kind}; a {what} is float16, float32 or float64");
            return Err(Error::data(path, "descr", problem));
        }
    };
    if data.len() != count * each {
        return Err(refuse(&format!("{count} numbers need {} bytes, the file has {}", count * each, data.len())));
    }
    let value = |number: &[u8]| {
        let mut eight = [0_u8; 8];
        eight[..each].copy_from_slice(number);
        if !little {
            eight[..each].reverse();
        }
        match each {
            2 => half::f16::from_le_bytes([eight[0], eight[1]]).to_f64(),
            4 => f64::from(f32::from_le_bytes([eight[0], eight[1], eight[2], eight[3]])),
            _ => f64::from_le_bytes(eight),
        }
    };
    Ok((shape, data.chunks_exact(each).map(value).collect()))
}
