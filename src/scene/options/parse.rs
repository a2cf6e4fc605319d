//! Parsers for flag values.

use std::str::FromStr;

/// Named colours, as on web pages.
const NAMED_COLOURS: [(&str, u32); 18] = [
    ("black", 0x000000),
    ("white", 0xffffff),
    ("red", 0xff0000),
    ("green", 0x008000),
    ("blue", 0x0000ff),
    ("yellow", 0xffff00),
    ("cyan", 0x00ffff),
    ("magenta", 0xff00ff),
    ("orange", 0xffa500),
    ("purple", 0x800080),
    ("pink", 0xffc0cb),
    ("brown", 0xa52a2a),
    ("grey", 0x808080),
    ("gray", 0x808080),
    ("silver", 0xc0c0c0),
    ("gold", 0xffd700),
    ("lime", 0x00ff00),
    ("navy", 0x000080),
];

/// Parses a colour: a name, a hexadecimal number such as `#ff0000`, or three numbers from 0 to 1.
pub fn colour(text: &str) -> Result<[f32; 3], String> {
    let name = text.trim().to_lowercase();
    let named = NAMED_COLOURS.iter().find(|(known, _)| *known == name).map(|&(_, bytes)| bytes);
    if let Some(bytes) = named.or_else(|| hexadecimal(&name)) {
        return Ok([16, 8, 0].map(|shift| f32::from((bytes >> shift) as u8) / 255.0));
    }
    let wrong = || {
        format!(
            "`{text}` is not a colour; expected a name such as red, #ff0000, or R,G,B from 0 to 1 each, such as 1,0,0"
        )
    };
    numbers::<f32, 3>(text).filter(|parts| parts.iter().all(|part| (0.0..=1.0).contains(part))).ok_or_else(wrong)
}

/// Parses numbers separated by commas.
fn numbers<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let numbers: Option<Vec<T>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

/// Parses `#rrggbb` or `#rgb`; the number sign is optional.
fn hexadecimal(text: &str) -> Option<u32> {
    let digits = text.strip_prefix('#').unwrap_or(text);
    let twice = |digits: &str| digits.chars().flat_map(|digit| [digit, digit]).collect::<String>();
    let digits = match digits.len() {
        3 => twice(digits),
        6 => digits.to_owned(),
        _ => return None,
    };
    // `from_str_radix` accepts a sign.
    if digits.chars().all(|digit| digit.is_ascii_hexdigit()) { u32::from_str_radix(&digits, 16).ok() } else { None }
}

/// Parses a count such as `1500`, `500k` or `2M`.
pub fn count(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is not a count; expected for example 1500, 500k or 2.5M");
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'm' | 'M')) => (&text[..at], 1e6),
        _ => return text.parse().map_err(|_| wrong()),
    };
    let value = digits.parse::<f64>().map_err(|_| wrong())? * unit;
    // Below 2^53, f64 represents every integer.
    if !(0.0..9e15).contains(&value) { Err(wrong()) } else { Ok(value.round() as u64) }
}

/// Units of memory, as powers of 2.
const MEMORY_UNITS: [(&str, u32); 3] = [("G", 30), ("M", 20), ("K", 10)];

/// Parses a number of bytes such as `1500M` or `2G`, in powers of 1024.
pub fn bytes(text: &str) -> Result<u64, String> {
    let wrong =
        || format!("`{text}` is not an amount of memory; expected a number followed by K, M or G, such as 1500M");
    let (number, unit) = text.trim().split_at_checked(text.trim().len().saturating_sub(1)).ok_or_else(wrong)?;
    let (_, shift) = MEMORY_UNITS.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)).ok_or_else(wrong)?;
    let value = number.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0).ok_or_else(wrong)?;
    Ok((value * f64::from(1_u32 << shift)) as u64)
}

/// A number of bytes in a file, in the syntax of [`bytes`].
pub mod as_bytes {
    use super::{MEMORY_UNITS, bytes};
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    /// Writes bytes with the largest unit that divides them.
    pub fn serialize<S: Serializer>(value: &u64, to: S) -> Result<S::Ok, S::Error> {
        let even = MEMORY_UNITS.into_iter().find(|(_, shift)| value.trailing_zeros() >= *shift);
        let (unit, shift) = even.unwrap_or(MEMORY_UNITS[MEMORY_UNITS.len() - 1]);
        to.serialize_str(&format!("{}{unit}", *value as f64 / f64::from(1_u32 << shift)))
    }

    /// Reads bytes with a unit.
    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<u64, D::Error> {
        bytes(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Parses the value of a switch without a flag: `on` or `off`.
#[cfg(feature = "cli")]
pub(super) fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" | "true" | "yes" => Ok(true),
        "off" | "false" | "no" => Ok(false),
        _ => Err(format!("`{text}` is neither on nor off")),
    }
}

/// Parses two corners of a box in space, the smaller coordinates first.
pub fn corners(text: &str) -> Result<[f64; 6], String> {
    let wrong = || format!("`{text}` is not a box; expected x0,y0,z0,x1,y1,z1, the smaller corner first");
    let is_box = |corners: &[f64; 6]| {
        corners.iter().all(|value| value.is_finite()) && (0..3).all(|axis| corners[axis] <= corners[axis + 3])
    };
    numbers(text).filter(is_box).ok_or_else(wrong)
}

/// Parses a number of objects, or `all`.
pub fn samples(text: &str) -> Result<u32, String> {
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

#[cfg(test)]
mod tests {
    use super::colour;

    #[test]
    fn a_colour_is_a_name_a_number_or_three() {
        let red = Ok([1.0, 0.0, 0.0]);
        for text in ["red", "Red", " red ", "#ff0000", "ff0000", "#F00", "f00", "1,0,0", "1.0, 0, 0"] {
            assert_eq!(colour(text), red, "{text}");
        }
        assert_eq!(colour("#336699"), Ok([0.2, 0.4, 0.6]));
        assert_eq!(colour("grey"), colour("gray"));
        for text in ["", "#", "reddish", "#ff00", "+ff000", "255,0,0", "1,0", "#ff00zz", "ä00"] {
            let message = colour(text).expect_err(text);
            assert!(message.contains(text) && message.contains("such as red, #ff0000"), "{message}");
        }
    }
}
