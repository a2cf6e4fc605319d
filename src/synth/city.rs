//! A city: houses, trees, vehicles and lamps on plots of 4 x 4 units between streets, too large for a single photo.

use super::land::{PLOT_COLUMNS, PLOT_PITCH, PLOT_ROWS, STREET_HALF_WIDTH};
use super::material::Pattern;
use super::object::Row;
use super::shape::Shape;
use glam::DVec3;

/// One house per plot.
const HOUSE_NAMES: [&str; (PLOT_COLUMNS * PLOT_ROWS) as usize] = [
    "townhall", "library", "bakery", "school", "theatre", "bank", "cinema", "museum", "hotel", "market", "chapel",
    "clinic", "brewery", "mill", "station", "court", "depot", "foundry", "gallery", "inn", "laundry", "studio",
    "villa", "workshop",
];
const TREE_NAMES: [&str; 14] = [
    "oak", "birch", "beech", "elm", "linden", "maple", "willow", "poplar", "cedar", "pine", "larch", "yew", "alder",
    "rowan",
];
const VEHICLE_NAMES: [&str; 10] =
    ["taxi", "van", "coupe", "bus", "jeep", "wagon", "lorry", "roadster", "minibus", "tanker"];
const LAMP_NAMES: [&str; 6] = ["lamp-1", "lamp-2", "lamp-3", "lamp-4", "lamp-5", "lamp-6"];

/// Returns the objects, with ids 1, 2, ... in order.
pub(super) fn rows() -> Vec<Row> {
    let houses = HOUSE_NAMES.iter().zip(0..).map(|(name, plot)| house(name, plot));
    let vehicles = VEHICLE_NAMES.iter().zip(0..).map(|(name, index)| vehicle(name, index));
    let lamps = LAMP_NAMES.iter().zip(0..).map(|(name, index)| lamp(name, index));
    houses.chain(yards()).chain(vehicles).chain(lamps).collect()
}

/// Returns a position in a plot from shares along its mirrored axes, so that neighbouring plots differ.
fn in_plot(plot: u32, across: f64, along: f64, height: f64) -> [f64; 3] {
    let (column, row) = (plot % PLOT_COLUMNS, plot / PLOT_COLUMNS);
    let middle = |index: u32, count: u32| (f64::from(index) + 0.5 - f64::from(count) / 2.0) * PLOT_PITCH;
    let mirror = |odd: u32| if odd.is_multiple_of(2) { 1.0 } else { -1.0 };
    let (x, y) = (mirror(column + row) * across, mirror(row / 2 + column) * along);
    [middle(column, PLOT_COLUMNS) + x, middle(row, PLOT_ROWS) + y, height]
}

fn house(name: &'static str, plot: u32) -> Row {
    let grown = 0.1 * f64::from(plot * 5 % 7);
    let (shape, height, pattern) = match plot * 7 % 6 {
        0 => (Shape::Block(DVec3::new(0.7, 0.62, 0.8 + grown)), 0.8 + grown, Pattern::Checks(0.36)),
        1 => (Shape::Block(DVec3::new(0.85, 0.5, 0.45 + grown)), 0.45 + grown, Pattern::Stripes(0.3, 2)),
        2 => (Shape::Cylinder(0.62, 0.7 + grown), 0.7 + grown, Pattern::Wedges(9)),
        3 => (Shape::RoundBlock(DVec3::new(0.55, 0.45, 0.25 + grown), 0.25), 0.5 + grown, Pattern::Stripes(0.28, 0)),
        4 => (Shape::Ball(DVec3::new(0.75, 0.75, 0.5 + grown)), 0.5 + grown, Pattern::Spots(0.4)),
        _ => (Shape::Block(DVec3::new(0.5, 0.8, 0.6 + grown)), 0.6 + grown, Pattern::Noise(0.5)),
    };
    (name, shape, in_plot(plot, 0.3, 0.3, height), f64::from(plot * 11 % 17) - 8.0, pattern)
}

/// Returns the trees and, on plots without one, what else stands in front of houses.
fn yards() -> impl Iterator<Item = Row> {
    let others = [
        ("fountain", Shape::Ring(0.26, 0.1), 0.1, Pattern::Wedges(6)),
        ("fence", Shape::Fence(6, 0.12, 0.2, 0.03), 0.2, Pattern::Stripes(0.15, 2)),
        ("skip", Shape::Bin(DVec3::new(0.3, 0.2, 0.17), 0.05), 0.17, Pattern::Checks(0.13)),
        ("hedge", Shape::RoundBlock(DVec3::new(0.2, 0.02, 0.1), 0.12), 0.22, Pattern::Noise(0.15)),
        ("kiosk", Shape::Cylinder(0.2, 0.3), 0.3, Pattern::Stripes(0.12, 2)),
        ("statue", Shape::RoundBlock(DVec3::new(0.0, 0.0, 0.3), 0.13), 0.43, Pattern::Noise(0.2)),
    ];
    let tree = |index: u32| {
        let size = 0.02 * f64::from(index * 5 % 7);
        match index % 3 {
            0 => (Shape::Ball(DVec3::new(0.34, 0.34, 0.42 + size)), 0.42 + size, Pattern::Noise(0.2)),
            1 => {
                (Shape::RoundBlock(DVec3::new(0.0, 0.0, 0.4 + 2.0 * size), 0.2), 0.6 + 2.0 * size, Pattern::Spots(0.2))
            }
            _ => (Shape::Ball(DVec3::splat(0.28 + size)), 0.28 + size, Pattern::Checks(0.17)),
        }
    };
    let is_wooded = |plot: &u32| plot * 7 % 12 < 7;
    let (wooded, free): (Vec<u32>, Vec<u32>) = (0..PLOT_COLUMNS * PLOT_ROWS).partition(is_wooded);
    let trees = TREE_NAMES.iter().zip(0..).zip(wooded).map(move |((name, index), plot)| {
        let (shape, height, pattern) = tree(index);
        (*name, shape, in_plot(plot, -0.85, -0.85, height), 0.0, pattern)
    });
    let others = others.into_iter().zip(free);
    trees.chain(others.map(|((name, shape, height, pattern), plot)| {
        (name, shape, in_plot(plot, -0.85, -0.85, height), 30.0, pattern)
    }))
}

/// Vehicles are parked at the sides of streets, so that a camera can pass between them.
fn vehicle(name: &'static str, index: u32) -> Row {
    let is_long = index.is_multiple_of(3);
    let half = if is_long { DVec3::new(0.42, 0.08, 0.14) } else { DVec3::new(0.24, 0.08, 0.07) };
    let height = half.z + 0.08;
    let side = if index.is_multiple_of(2) { 0.43 } else { -0.43 };
    // Alternate streets along x and y; positions away from crossings.
    let along = PLOT_PITCH * (f64::from(index * 3 % 5) - 2.0) + 0.35 * f64::from(index % 4) - 0.6;
    let (position, turn) = match index % 4 {
        0 | 3 => ([along + PLOT_PITCH / 2.0, PLOT_PITCH * (f64::from(index / 4) - 1.0) + side, height], 0.0),
        _ => ([PLOT_PITCH * (f64::from(index % 5) - 2.0) + side, 0.7 * along + PLOT_PITCH / 2.0 - 0.3, height], 90.0),
    };
    (name, Shape::RoundBlock(half, 0.08), position, turn, Pattern::Checks(0.14))
}

/// Lamps are at the corners of crossings.
fn lamp(name: &'static str, index: u32) -> Row {
    let at = |crossing: u32, middle: f64| PLOT_PITCH * (f64::from(crossing) - middle) + STREET_HALF_WIDTH + 0.1;
    let position = [at(index * 2 % 5, 2.0), at(index % 3, 1.0), 0.6];
    (name, Shape::RoundBlock(DVec3::new(0.0, 0.0, 0.55), 0.05), position, 0.0, Pattern::Stripes(0.2, 2))
}
