//! The objects of the presets.

use super::material::{Material, Pattern, hsv};
use super::object::{Object, Row};
use super::shape::Shape;
use super::{Preset, city, hard, hash01, turntable};
use glam::{DQuat, DVec3};

/// Returns the objects of a preset, with ids 1, 2, ... in order.
pub(super) fn objects(preset: Preset, seed: u64) -> Vec<Object> {
    let rows = match preset {
        Preset::Default => default_rows(),
        Preset::Simple => simple_rows(),
        Preset::Hard => hard::rows(),
        Preset::City => city::rows(),
        Preset::Turntable | Preset::TurnedOver => turntable::rows(),
    };
    rows.into_iter().enumerate().map(|(index, row)| object(index, row, seed)).collect()
}

/// A crate at the centre, with others against its faces, on top of it and inside each other.
fn default_rows() -> Vec<Row> {
    let turn = 25.0_f64;
    // A position at a distance from the crate's centre, across one of its four faces.
    let across = |quarter: f64, distance: f64, height: f64| {
        let angle = (turn + 90.0 * quarter).to_radians();
        [angle.cos() * distance, angle.sin() * distance, height]
    };
    let block = |x: f64, y: f64, z: f64| Shape::Block(DVec3::new(x, y, z));
    vec![
        ("crate", block(0.45, 0.45, 0.35), [0.0, 0.0, 0.35], turn, Pattern::Checks(0.17)),
        ("globe", Shape::Ball(DVec3::splat(0.34)), [-0.06, 0.05, 1.04], 0.0, Pattern::Noise(0.22)),
        ("barrel", Shape::Cylinder(0.3, 0.42), across(0.0, 0.75, 0.42), 0.0, Pattern::Stripes(0.16, 2)),
        ("ring", Shape::Ring(0.4, 0.13), across(3.0, 0.98, 0.13), 0.0, Pattern::Wedges(7)),
        ("egg", Shape::Ball(DVec3::new(0.21, 0.21, 0.3)), across(3.0, 0.98, 0.3), 40.0, Pattern::Spots(0.17)),
        (
            "cushion",
            Shape::RoundBlock(DVec3::new(0.3, 0.26, 0.07), 0.1),
            across(2.0, 0.85, 0.17),
            turn,
            Pattern::Stripes(0.14, 1),
        ),
        (
            "bollard",
            Shape::RoundBlock(DVec3::new(0.0, 0.0, 0.42), 0.2),
            across(1.0, 0.65, 0.62),
            0.0,
            Pattern::Noise(0.3),
        ),
        ("parcel", block(0.17, 0.17, 0.13), across(0.0, 0.75, 0.97), 55.0, Pattern::Checks(0.13)),
    ]
}

/// A ball on a block, and a cylinder beside them.
fn simple_rows() -> Vec<Row> {
    vec![
        ("block", Shape::Block(DVec3::new(0.5, 0.5, 0.4)), [0.0, 0.0, 0.4], 20.0, Pattern::Checks(0.22)),
        ("ball", Shape::Ball(DVec3::splat(0.4)), [0.0, 0.0, 1.2], 0.0, Pattern::Noise(0.3)),
        ("can", Shape::Cylinder(0.3, 0.5), [0.8, 0.35, 0.5], 0.0, Pattern::Stripes(0.2, 2)),
    ]
}

fn object(index: usize, (name, shape, position, turn, pattern): Row, seed: u64) -> Object {
    let id = index as u64 + 1;
    let random = |what: u64| hash01(seed, 1, id, what);
    let hue = (index as f64 * 0.381_966 + 0.55 + 0.15 * random(0)).fract();
    let mut material = Material {
        pattern,
        first: hsv(hue, 0.5, 0.88),
        second: hsv(hue + 0.09, 0.62, 0.48),
        offset: DVec3::new(random(1), random(2), random(3)) * 0.05 + 0.013,
        seed: seed.wrapping_mul(1009).wrapping_add(id * 16),
    };
    if name == turntable::OBJECT_NAME {
        [material.first, material.second] = turntable::OBJECT_COLOURS;
    }
    match pattern {
        Pattern::Plain => material.first = DVec3::splat(hard::BLACK_ALBEDO),
        Pattern::Ground => material = Material { offset: DVec3::from_array(position), seed, ..material },
        _ => {}
    }
    Object {
        id: id as u8,
        name,
        shape,
        position: DVec3::from_array(position),
        rotation: DQuat::from_rotation_z(turn.to_radians()),
        material,
    }
}
