//! The compressed PLY of PlayCanvas: chunks of 256 Gaussians with bounds, and values of 10 or 11 bits within them. It is
//! only read: its readers refuse any further element, so labels have no place.

use crate::format::ReadModel;
use crate::ply_table::Elements;
use crate::rows::{Row, Rows};
use crate::values::logit_of_byte;
use labelgs_scene::harmonics::sh0_of;
use labelgs_scene::{Error, Result};
use std::f64::consts::SQRT_2;
use std::path::Path;

/// Gaussians in a chunk.
const CHUNK: usize = 256;
/// Columns of a chunk that every file has: bounds of positions and of log-scales.
const BOUNDS: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];
/// Bounds of colours, which older files lack.
const COLOURS: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];
const PACKED: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// Returns true for a file that is compressed.
pub(super) fn is_packed(path: &Path) -> Result<bool> {
    Ok(Elements::open(path, PACKED[0])?.is_some())
}

/// Reads a file that is compressed; `None` for any other PLY.
pub(super) fn read(path: &Path) -> Result<Option<ReadModel>> {
    let Some(elements) = Elements::open(path, PACKED[0])? else { return Ok(None) };
    let bounds = elements.columns("chunk", &BOUNDS)?;
    let colours = if elements.has("chunk", COLOURS[0]) { Some(elements.columns("chunk", &COLOURS)?) } else { None };
    let packed = elements.columns("vertex", &PACKED)?;
    let (count, chunks) = (packed.rows(), bounds.rows());
    if chunks < count.div_ceil(CHUNK) {
        let problem =
            format!("has {chunks} chunks for {count} Gaussians; expected one for each {CHUNK}; export it again");
        return Err(Error::data(path, "header", problem));
    }
    let degree = (1..=3).rev().find(|&degree| elements.has("sh", &format!("f_rest_{}", values(degree) - 1)));
    let degree = degree.unwrap_or(0);
    let names: Vec<String> = (0..values(degree)).map(|index| format!("f_rest_{index}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let harmonics = if degree > 0 { Some(elements.columns("sh", &names)?) } else { None };
    if harmonics.as_ref().is_some_and(|columns| columns.rows() != count) {
        return Err(Error::data(path, "header", "the elements `sh` and `vertex` differ in length; export it again"));
    }
    let mut rows = Rows::new(degree as u32, false, false);
    let mut rest = vec![[0.0; 3]; values(degree) / 3];
    for index in 0..count {
        let chunk = index / CHUNK;
        let [place, spin, size, colour] = packed.row::<4>(index).map(|value| value as u32);
        let bound = bounds.row::<12>(chunk);
        let shade = colours.as_ref().map_or([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], |columns| columns.row::<6>(chunk));
        let within = |share: [f64; 3], at: usize| {
            [0, 1, 2].map(|axis| bound[at + axis] + share[axis] * (bound[at + 3 + axis] - bound[at + axis]))
        };
        let [r, g, b, alpha] = colour.to_be_bytes();
        let tint = [r, g, b].map(|byte| f64::from(byte) / 255.0);
        if let Some(columns) = &harmonics {
            let third = rest.len();
            for (k, triple) in rest.iter_mut().enumerate() {
                *triple = [0, 1, 2].map(|channel| harmonic(columns.value(index, channel * third + k) as u8));
            }
        }
        rows.push(&Row {
            position: within(thirds(place), 0),
            scale: within(thirds(size), 6).map(|value| value as f32),
            quat: quat(spin),
            opacity: logit_of_byte(alpha),
            sh0: [0, 1, 2].map(|c| sh0_of(shade[c] + tint[c] * (shade[3 + c] - shade[c]))),
            rest: &rest,
            ..Row::default()
        });
    }
    let mut read = rows.finish(path, None)?;
    read.gaussians.antialiased = super::is_antialiased(elements.comments());
    Ok(Some(read))
}

/// Number of values above degree 0.
fn values(degree: usize) -> usize {
    3 * ((degree + 1) * (degree + 1) - 1)
}

/// Three shares in 11, 10 and 11 bits.
fn thirds(packed: u32) -> [f64; 3] {
    [f64::from(packed >> 21) / 2047.0, f64::from(packed >> 11 & 1023) / 1023.0, f64::from(packed & 2047) / 2047.0]
}

/// The rotation (w, x, y, z): which component is the largest, and the three others in order.
fn quat(packed: u32) -> [f64; 4] {
    let small = [20, 10, 0].map(|shift| (f64::from(packed >> shift & 1023) / 1023.0 - 0.5) * SQRT_2);
    let largest = (1.0 - small.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
    let [a, b, c] = small;
    match packed >> 30 {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    }
}

/// A coefficient from -4 to 4.
fn harmonic(byte: u8) -> f32 {
    let share = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (f32::from(byte) + 0.5) / 256.0,
    };
    8.0 * (share - 0.5)
}
