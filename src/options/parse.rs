//! Parsers for the values of flags.

/// Parses a colour: a name, or three numbers from 0 to 1.
pub(crate) fn colour(text: &str) -> Result<[f32; 3], String> {
    match text {
        "black" => return Ok([0.0; 3]),
        "white" => return Ok([1.0; 3]),
        _ => {}
    }
    let wrong = || format!("`{text}` is not a colour; expected black, white, or R,G,B from 0 to 1 each");
    let parts = text.split(',').map(|part| part.trim().parse::<f32>().ok().filter(|value| (0.0..=1.0).contains(value)));
    let parts: Vec<f32> = parts.collect::<Option<_>>().ok_or_else(wrong)?;
    parts.try_into().map_err(|_| wrong())
}

/// Parses a count such as `1500`, `500k` or `2M`.
pub(crate) fn count(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is not a count; expected for example 1500, 500k or 2.5M");
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'm' | 'M')) => (&text[..at], 1e6),
        _ => return text.parse().map_err(|_| wrong()),
    };
    let value = digits.parse::<f64>().map_err(|_| wrong())? * unit;
    // Below 2^53, f64 holds every whole number.
    if !(0.0..9e15).contains(&value) { Err(wrong()) } else { Ok(value.round() as u64) }
}

/// Units of memory, as powers of 2.
const UNITS: [(&str, u32); 3] = [("G", 30), ("M", 20), ("K", 10)];

/// Parses a number of bytes such as `1500M` or `2G`, in powers of 1024.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let wrong =
        || format!("`{text}` is not an amount of memory; expected a number followed by K, M or G, such as 1500M");
    let (number, unit) = text.trim().split_at_checked(text.trim().len().saturating_sub(1)).ok_or_else(wrong)?;
    let (_, shift) = UNITS.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)).ok_or_else(wrong)?;
    let value = number.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0).ok_or_else(wrong)?;
    Ok((value * f64::from(1_u32 << shift)) as u64)
}

/// A number of bytes in a file, in the syntax of [`bytes`].
pub(crate) mod as_bytes {
    use super::{UNITS, bytes};
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(crate) fn serialize<S: Serializer>(value: &u64, to: S) -> Result<S::Ok, S::Error> {
        let even = UNITS.into_iter().find(|(_, shift)| value.trailing_zeros() >= *shift);
        let (unit, shift) = even.unwrap_or(UNITS[UNITS.len() - 1]);
        to.serialize_str(&format!("{}{unit}", *value as f64 / f64::from(1_u32 << shift)))
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<u64, D::Error> {
        bytes(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Parses `on` or `off`.
pub(crate) fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" | "true" | "yes" => Ok(true),
        "off" | "false" | "no" => Ok(false),
        _ => Err(format!("`{text}` is neither on nor off")),
    }
}

/// Parses two corners of a box in space, the smaller coordinates first.
pub(crate) fn corners(text: &str) -> Result<[f64; 6], String> {
    let wrong = || format!("`{text}` is not a box; expected x0,y0,z0,x1,y1,z1, the smaller corner first");
    let numbers = text.split(',').map(|part| part.trim().parse().ok().filter(|value: &f64| value.is_finite()));
    let numbers: Vec<f64> = numbers.collect::<Option<_>>().ok_or_else(wrong)?;
    let corners: [f64; 6] = numbers.try_into().map_err(|_| wrong())?;
    if (0..3).all(|axis| corners[axis] <= corners[axis + 3]) { Ok(corners) } else { Err(wrong()) }
}

/// Parses a number of objects, or `all`.
pub(crate) fn samples(text: &str) -> Result<u32, String> {
    match text {
        "all" => Ok(u32::MAX),
        _ => text.parse().map_err(|_| format!("`{text}` is neither a number of objects nor all")),
    }
}

/// Converts a TOML value to the syntax of the command line.
pub(super) fn as_typed(value: &str) -> String {
    match value {
        "true" => "on".into(),
        "false" => "off".into(),
        _ => value.trim_matches('"').to_owned(),
    }
}
