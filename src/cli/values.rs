//! Parsers of single values.

/// A list of labels, sorted, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Labels(pub Vec<u32>);

/// Width and height, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub u32, pub u32);

/// Labels such as `1,4-6`.
pub fn labels(text: &str) -> Result<Labels, String> {
    let id = |text: &str| match text.trim().parse::<u32>() {
        Ok(id) if id <= crate::scene::labels::LABEL_MAX => Ok(id),
        _ => Err(format!("`{text}` is no label; labels are whole numbers from 0 to 65535, such as 1,4-6")),
    };
    let mut ids = std::collections::BTreeSet::new();
    for part in text.split(',') {
        match part.split_once('-') {
            Some((first, last)) => {
                let (first, last) = (id(first)?, id(last)?);
                if first > last {
                    return Err(format!("`{part}` runs backwards"));
                }
                ids.extend(first..=last);
            }
            None => {
                ids.insert(id(part)?);
            }
        }
    }
    Ok(Labels(ids.into_iter().collect()))
}

/// A size such as `320x240`.
pub fn size(text: &str) -> Result<Size, String> {
    let wrong = || format!("`{text}` is no size; expected WIDTHxHEIGHT in px, 1 to 16384 each, such as 320x240");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |text: &str| text.trim().parse().ok().filter(|side| (1..=16_384).contains(side)).ok_or_else(wrong);
    Ok(Size(side(width)?, side(height)?))
}

/// A colour: a name, or three numbers from 0 to 1.
pub fn colour(text: &str) -> Result<[f32; 3], String> {
    match text {
        "black" => return Ok([0.0; 3]),
        "white" => return Ok([1.0; 3]),
        _ => {}
    }
    let wrong = || format!("`{text}` is no colour; expected black, white, or R,G,B from 0 to 1 each");
    let parts = text.split(',').map(|part| part.trim().parse::<f32>().ok().filter(|value| (0.0..=1.0).contains(value)));
    let parts: Vec<f32> = parts.collect::<Option<_>>().ok_or_else(wrong)?;
    parts.try_into().map_err(|_| wrong())
}

/// A number of things such as `1500`, `500k` or `2M`.
pub fn count(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is no number of things; expected such as 1500, 500k or 2.5M");
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'm' | 'M')) => (&text[..at], 1e6),
        _ => return text.parse().map_err(|_| wrong()),
    };
    let value = digits.parse::<f64>().map_err(|_| wrong())? * unit;
    // Below 2^53, where every whole number is a f64.
    if !(0.0..9e15).contains(&value) { Err(wrong()) } else { Ok(value.round() as u64) }
}

/// `on` or `off`.
pub fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" | "true" | "yes" => Ok(true),
        "off" | "false" | "no" => Ok(false),
        _ => Err(format!("`{text}` is neither on nor off")),
    }
}

/// A number of objects, or `all`.
pub fn samples(text: &str) -> Result<u32, String> {
    match text {
        "all" => Ok(u32::MAX),
        _ => text.parse().map_err(|_| format!("`{text}` is neither a number of objects nor all")),
    }
}
