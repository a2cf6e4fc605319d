//! Parsers of single values.

use crate::Error;
use crate::edit::catalogue::Pick;
use crate::formats::check_output;
use crate::options::parse;
use crate::scene::MODEL_LABEL_MAX;
use clap::builder::{PathBufValueParser, TypedValueParser};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str::FromStr;

pub(crate) use crate::options::parse::{bytes, colour, count};

/// Labels by id and by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picks(pub Vec<Pick>);

/// A pixel of a view: column and row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewPixel {
    /// Name of the view.
    pub view: String,
    /// Column and row.
    pub pixel: [u32; 2],
}

/// A box in a view: first column and row, and one past the last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewBox {
    /// Name of the view.
    pub view: String,
    /// x0, y0, x1, y1.
    pub corners: [u32; 4],
}

/// New ids by old ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Renumbering(pub BTreeMap<u32, u32>);

/// Width and height, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub u32, pub u32);

/// Parses the path of a model to write: a wrong extension is refused before any work.
pub(crate) fn model_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match check_output(&path) {
        Err(Error::Usage { problem, .. }) => Err(problem),
        Err(other) => Err(other.to_string()),
        Ok(()) => Ok(path),
    })
}

/// Parses the path of a file of JSON to write.
pub(crate) fn json_file() -> impl TypedValueParser<Value = PathBuf> {
    file_of("json", "JSON")
}

/// Parses the path of a page to write.
pub(crate) fn page_file() -> impl TypedValueParser<Value = PathBuf> {
    file_of("html", "an HTML page")
}

/// Parses the path of a sheet of labels to write.
pub(crate) fn sheet_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("html") || extension.eq_ignore_ascii_case("png") => Ok(path),
        _ => Err("expected the extension .html (a page with names and numbers) or .png (an image)"),
    })
}

/// Parses an output path. An extension must be the given one.
fn file_of(extension: &'static str, what: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| match path.extension() {
        Some(other) if !other.eq_ignore_ascii_case(extension) => {
            Err(format!("this file is {what}; expected the extension .{extension}"))
        }
        _ => Ok(path),
    })
}

/// Parses labels such as `1,4-6,cup`. Digits and dashes alone are an id or a range of ids.
pub(crate) fn picks(text: &str) -> Result<Picks, String> {
    let pick = |part: &str| {
        if part.is_empty() {
            return Err("an empty name; expected ids or names, such as 1,4-6,cup".to_owned());
        }
        if !part.chars().all(|c| c.is_ascii_digit() || c == '-' || c == ' ') {
            return Ok(Pick::Name(part.to_owned()));
        }
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (label(first)?, label(last)?);
        if first > last {
            Err(format!("`{part}` runs backwards; expected FIRST-LAST"))
        } else {
            Ok(Pick::Ids(first, last))
        }
    };
    text.split(',').map(|part| pick(part.trim())).collect::<Result<_, _>>().map(Picks)
}

/// Parses a label; 0 means no label.
pub(crate) fn label(text: &str) -> Result<u32, String> {
    let id = text.trim().parse().ok().filter(|&id| id <= MODEL_LABEL_MAX);
    id.ok_or_else(|| {
        format!("`{text}` is not a label; labels are whole numbers from 0 to {MODEL_LABEL_MAX}, such as 1,4-6")
    })
}

/// Parses old and new labels such as `3=7,4=0`.
pub(crate) fn renumbering(text: &str) -> Result<Renumbering, String> {
    let mut map = BTreeMap::new();
    for part in text.split(',') {
        let (old, new) = part.split_once('=').ok_or_else(|| format!("`{part}` is not OLD=NEW, such as 3=7"))?;
        let (old, new) = (label(old)?, label(new)?);
        if map.insert(old, new).is_some() {
            return Err(format!("label {old} has two new ids"));
        }
    }
    Ok(Renumbering(map))
}

/// Parses a pixel of a view such as `004:120,80`.
pub(crate) fn view_pixel(text: &str) -> Result<ViewPixel, String> {
    let (view, pixel) = in_view(text, "VIEW:x,y in whole px, such as 004:120,80")?;
    Ok(ViewPixel { view, pixel })
}

/// Parses a box in a view such as `004:100,60,160,120`.
pub(crate) fn view_box(text: &str) -> Result<ViewBox, String> {
    let (view, corners) = in_view(text, "VIEW:x0,y0,x1,y1 in whole px, such as 004:100,60,160,120")?;
    let [x0, y0, x1, y1] = corners;
    if x0 >= x1 || y0 >= y1 {
        return Err(format!("`{text}` is empty; the second corner must be right of and below the first"));
    }
    Ok(ViewBox { view, corners })
}

/// Parses the name of a view and the numbers after the last colon.
fn in_view<const N: usize>(text: &str, expected: &str) -> Result<(String, [u32; N]), String> {
    let wrong = || format!("`{text}` is not {expected}");
    let (view, numbers) = text.rsplit_once(':').filter(|(view, _)| !view.is_empty()).ok_or_else(wrong)?;
    let numbers: Option<Vec<u32>> = numbers.split(',').map(|number| number.trim().parse().ok()).collect();
    let numbers = numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(wrong)?;
    Ok((view.to_owned(), numbers))
}

/// Parses a number that is what was `expected`.
fn number<T: FromStr + Copy>(text: &str, is_valid: impl Fn(T) -> bool, expected: &str) -> Result<T, String> {
    text.parse().ok().filter(|&value| is_valid(value)).ok_or_else(|| format!("`{text}` is not {expected}"))
}

/// Parses a share, 0 to 1.
pub(crate) fn share(text: &str) -> Result<f32, String> {
    number(text, |value| (0.0..=1.0).contains(&value), "a share; expected 0 to 1")
}

/// Parses a distance, world units, 0 or more.
pub(crate) fn distance(text: &str) -> Result<f64, String> {
    number(text, |value: f64| value.is_finite() && value >= 0.0, "a distance; expected 0 or more, in world units")
}

/// Parses a loss of PSNR, dB, 0 or more.
pub(crate) fn loss(text: &str) -> Result<f64, String> {
    number(text, |value: f64| value.is_finite() && value >= 0.0, "a loss of PSNR; expected 0 or more, in dB")
}

/// Parses a time, s, more than 0 and at most an hour.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    number(text, |value: f64| value > 0.0 && value <= 3600.0, "a time; expected more than 0 and at most 3600, in s")
}

/// Parses a factor, more than 0.
pub(crate) fn factor(text: &str) -> Result<f64, String> {
    number(text, |value: f64| value.is_finite() && value > 0.0, "a factor; expected more than 0")
}

/// Parses a near plane, world units, more than 0.
pub(crate) fn near(text: &str) -> Result<f32, String> {
    number(text, |value: f32| value.is_finite() && value > 0.0, "a near plane; expected more than 0, in world units")
}

/// Parses a place such as `1.5,0,-2`.
pub(crate) fn place(text: &str) -> Result<DVec3, String> {
    numbers(text)
        .map(DVec3::from_array)
        .ok_or_else(|| format!("`{text}` is not a point; expected X,Y,Z such as 1.5,0,-2"))
}

/// Parses a direction: an axis such as `-y`, or X,Y,Z.
pub(crate) fn direction(text: &str) -> Result<DVec3, String> {
    let (sign, axis) = text.strip_prefix('-').map_or((1.0, text), |axis| (-1.0, axis));
    match axis {
        "x" => Ok(sign * DVec3::X),
        "y" => Ok(sign * DVec3::Y),
        "z" => Ok(sign * DVec3::Z),
        _ => numbers(text).map(DVec3::from_array).filter(|along| *along != DVec3::ZERO).ok_or_else(|| {
            format!("`{text}` is not a direction; expected x, -x, y, -y, z, -z or X,Y,Z such as 0,0.1,1")
        }),
    }
}

/// Parses two corners of a box in space: the smaller coordinates first.
pub(crate) fn corners(text: &str) -> Result<[DVec3; 2], String> {
    let [a, b, c, d, e, f] = parse::corners(text)?;
    Ok([DVec3::new(a, b, c), DVec3::new(d, e, f)])
}

/// Parses finite numbers between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok().filter(|value: &f64| value.is_finite())).collect();
    all?.try_into().ok()
}

/// Parses a size such as `320x240`.
pub(crate) fn size(text: &str) -> Result<Size, String> {
    let wrong = || format!("`{text}` is not a size; expected WIDTHxHEIGHT in px, 1 to 16384 each, such as 320x240");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let side = |text: &str| text.trim().parse().ok().filter(|side| (1..=16_384).contains(side)).ok_or_else(wrong);
    Ok(Size(side(width)?, side(height)?))
}
