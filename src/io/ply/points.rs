//! Coloured points.

use super::table::Table;
use crate::error::{Error, Result};
use crate::io::listing::FAR;
use crate::scene::Point;
use glam::DVec3;
use std::path::Path;

/// Reads points from a PLY with `x y z` and optional `red green blue`. Colours are integers from 0 to 255, or floats
/// from 0 to 1; floats count as 0 to 255 if one of them exceeds 1. Points without colour become mid-grey. Leaves out
/// points that are not finite or whose squares do not fit into f32.
pub fn read_points(path: impl AsRef<Path>) -> Result<Vec<Point>> {
    let path = path.as_ref();
    let table = Table::open(path)?;
    let mut columns = vec!["x", "y", "z"];
    let colours = ["red", "green", "blue"];
    let coloured = colours.iter().all(|colour| table.names().any(|name| name == *colour));
    let floats = coloured && table.is_float("red");
    if coloured {
        columns.extend(colours);
    }
    let mut rows: Vec<([f64; 3], [f64; 3])> = Vec::new();
    table.for_each(&columns, |index, row| {
        let mut colour = [128.0; 3];
        if coloured {
            colour.copy_from_slice(&row[3..6]);
        }
        if colour.iter().any(|value| !value.is_finite()) {
            return Err(Error::data(path, format!("vertex {index}"), "has a colour of NaN or infinity"));
        }
        if row[..3].iter().all(|value| value.abs() <= FAR) {
            rows.push(([row[0], row[1], row[2]], colour));
        }
        Ok(())
    })?;
    let unit = floats && rows.iter().all(|(_, colour)| colour.iter().all(|&value| value <= 1.0));
    let scale = if unit { 255.0 } else { 1.0 };
    let point = |(position, colour): ([f64; 3], [f64; 3])| Point {
        position: DVec3::from_array(position),
        colour: colour.map(|value| (value * scale).round().clamp(0.0, 255.0) as u8),
    };
    Ok(rows.into_iter().map(point).collect())
}
