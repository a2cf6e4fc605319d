//! Reads coloured points.

use super::listing::DISTANCE_MAX;
use glam::DVec3;
use labelgs_formats::ply_table::Table;
use labelgs_scene::{Error, Point, Result};
use std::path::Path;

/// Property names of red, green and blue in different programs.
const COLOUR_NAMES: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];

/// Reads points from a PLY with `x y z` and optional colours. Colours are integers from 0 to 255 (or to 65535 if they
/// have 16 bits and one exceeds 255), or floats from 0 to 1 (or to 255 if one exceeds 1). Points without colour become
/// mid-grey. Omits points that are not finite or whose squares do not fit into f32.
pub fn read_points(path: impl AsRef<Path>) -> Result<Vec<Point>> {
    let path = path.as_ref();
    let table = Table::open(path)?;
    if table.has("packed_position") {
        let cure = "a compressed PLY, which can only be read as a model; convert it to a plain PLY first";
        return Err(Error::data(path, "header", cure));
    }
    let has = |colours: &&[&str; 3]| colours.iter().all(|colour| table.names().any(|name| name == *colour));
    let colours = COLOUR_NAMES.iter().find(has);
    let largest = colours.and_then(|colours| table.integer_max(colours[0]));
    let columns: Vec<&str> = ["x", "y", "z"].iter().chain(colours.into_iter().flatten()).copied().collect();
    let mut rows: Vec<([f64; 3], [f64; 3])> = Vec::new();
    table.for_each(&columns, |index, row| {
        let colour = if let [_, _, _, r, g, b] = *row { [r, g, b] } else { [128.0; 3] };
        if colour.iter().any(|value| !value.is_finite()) {
            return Err(Error::data(path, format!("vertex {index}"), "has a colour of NaN or infinity"));
        }
        if row[..3].iter().all(|value| value.abs() <= DISTANCE_MAX) {
            rows.push(([row[0], row[1], row[2]], colour));
        }
        Ok(())
    })?;
    let is_within = |limit: f64| rows.iter().all(|(_, colour)| colour.iter().all(|&value| value <= limit));
    let largest = match largest {
        _ if colours.is_none() => 255.0,
        None if is_within(1.0) => 1.0,
        Some(largest) if !is_within(255.0) => largest,
        _ => 255.0,
    };
    let point = |(position, colour): ([f64; 3], [f64; 3])| Point {
        position: DVec3::from_array(position),
        colour: colour.map(|value| (value * 255.0 / largest).round().clamp(0.0, 255.0) as u8),
    };
    Ok(rows.into_iter().map(point).collect())
}
