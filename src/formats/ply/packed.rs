//! The compressed PLY of PlayCanvas: chunks of 256 Gaussians with bounds, and values of 10 or 11 bits within them. It
//! is read-only: its readers refuse additional elements, so there is no place for labels.

use crate::format::ReadModel;
use crate::ply_table::Table;
use crate::rows::{Row, Rows};
use crate::values::{logit_of_byte, with_largest};
use labelgs_scene::harmonics::{coefficients, sh0_of};
use labelgs_scene::{Error, Result};
use std::f64::consts::SQRT_2;
use std::path::Path;

/// Gaussians in a chunk.
const CHUNK_GAUSSIANS: u64 = 256;
/// Chunk columns in every file: bounds of positions and log-scales.
const BOUND_COLUMNS: [&str; 12] = [
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
const COLOUR_BOUND_COLUMNS: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];
const PACKED_COLUMNS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// Returns true for the table of a compressed file.
pub(super) fn is_packed(vertex: &Table) -> bool {
    vertex.has(PACKED_COLUMNS[0])
}

/// Reads a compressed file whose `vertex` element is open.
pub(super) fn read(path: &Path, vertex: Table) -> Result<ReadModel> {
    let bounds = bounds(path)?;
    let (count, chunks) = (vertex.count(), bounds.len() as u64);
    if chunks < count.div_ceil(CHUNK_GAUSSIANS) {
        let problem = format!(
            "has {chunks} chunks for {count} Gaussians; expected one for each {CHUNK_GAUSSIANS}; export it again"
        );
        return Err(Error::data(path, "header", problem));
    }
    let (degree, codes) = harmonics(path, count)?;
    let mut rows = Rows::new(degree, false, false);
    let mut rest = vec![[0.0; 3]; coefficients(degree)];
    let antialiased = super::is_antialiased(vertex.comments());
    vertex.for_each(&PACKED_COLUMNS, |index, row| {
        let [place, spin, size, colour] = [0, 1, 2, 3].map(|column| row[column] as u32);
        let bound = &bounds[(index / CHUNK_GAUSSIANS) as usize];
        let within = |share: [f64; 3], at: usize| {
            [0, 1, 2].map(|axis| bound[at + axis] + share[axis] * (bound[at + 3 + axis] - bound[at + axis]))
        };
        let [r, g, b, alpha] = colour.to_be_bytes();
        let third = rest.len();
        for (k, triple) in rest.iter_mut().enumerate() {
            let first = 3 * third * index as usize + k;
            *triple = [0, 1, 2].map(|channel| harmonic(codes[first + channel * third]));
        }
        rows.push(&Row {
            position: within(thirds(place), 0),
            scale: within(thirds(size), 6).map(|value| value as f32),
            quat: quat(spin),
            opacity: logit_of_byte(alpha),
            sh0: within([r, g, b].map(|byte| f64::from(byte) / 255.0), 12).map(sh0_of),
            rest: &rest,
            ..Row::default()
        });
        Ok(())
    })?;
    let mut read = rows.finish(path, None)?;
    read.gaussians.antialiased = antialiased;
    Ok(read)
}

/// Reads the bounds of each chunk. Colours without bounds range from 0 to 1.
fn bounds(path: &Path) -> Result<Vec<[f64; 18]>> {
    let problem = "has no element `chunk`; a compressed PLY has `chunk` and `vertex`";
    let chunk = Table::open_element(path, "chunk")?.ok_or_else(|| Error::data(path, "header", problem))?;
    let names = if chunk.has(COLOUR_BOUND_COLUMNS[0]) {
        [&BOUND_COLUMNS[..], &COLOUR_BOUND_COLUMNS].concat()
    } else {
        BOUND_COLUMNS.to_vec()
    };
    let mut all = Vec::new();
    chunk.for_each(&names, |_, row| {
        let mut bounds = [0.0; 18];
        bounds[15..].fill(1.0);
        bounds[..row.len()].copy_from_slice(row);
        all.push(bounds);
        Ok(())
    })?;
    Ok(all)
}

/// Reads the SH degree and the harmonics of `count` Gaussians as bytes, channel by channel.
fn harmonics(path: &Path, count: u64) -> Result<(u32, Vec<u8>)> {
    let mut codes = Vec::new();
    let Some(table) = Table::open_element(path, "sh")? else { return Ok((0, codes)) };
    let has = |degree: &u32| table.has(&format!("f_rest_{}", 3 * coefficients(*degree) - 1));
    let Some(degree) = (1..=3).rev().find(has) else { return Ok((0, codes)) };
    if table.count() != count {
        return Err(Error::data(path, "header", "the elements `sh` and `vertex` differ in length; export it again"));
    }
    let names: Vec<String> = (0..3 * coefficients(degree)).map(|index| format!("f_rest_{index}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    table.for_each(&names, |_, row| {
        codes.extend(row.iter().map(|&value| value as u8));
        Ok(())
    })?;
    Ok((degree, codes))
}

/// Unpacks three fractions of 11, 10 and 11 bits.
fn thirds(packed: u32) -> [f64; 3] {
    [f64::from(packed >> 21) / 2047.0, f64::from(packed >> 11 & 1023) / 1023.0, f64::from(packed & 2047) / 2047.0]
}

/// Unpacks a rotation (w, x, y, z) stored as the index of the largest component and the three others in order.
fn quat(packed: u32) -> [f64; 4] {
    let small = [20, 10, 0].map(|shift| (f64::from(packed >> shift & 1023) / 1023.0 - 0.5) * SQRT_2);
    let largest = (1.0 - small.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
    with_largest(largest, packed >> 30, small)
}

/// Converts a byte to a coefficient from -4 to 4.
fn harmonic(byte: u8) -> f32 {
    let share = match byte {
        0 => 0.0,
        255 => 1.0,
        _ => (f32::from(byte) + 0.5) / 256.0,
    };
    8.0 * (share - 0.5)
}
