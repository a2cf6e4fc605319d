//! Objects that are hard to label. Each has a single difficulty, measured by `tests/truth.rs`.

use super::material::Pattern;
use super::object::Row;
use super::shape::Shape;
use glam::DVec3;

/// Albedo of the black object, which in an 8-bit photo looks like a hole.
pub(super) const BLACK_ALBEDO: f64 = 0.018;
/// Half the thickness of wires and bars, one to three pixels in a typical view, world units.
const THIN_RADIUS: f64 = 0.013;

/// Returns the objects, with ids 1, 2, ... in order.
pub(super) fn rows() -> Vec<Row> {
    let block = |x: f64, y: f64, z: f64| Shape::Block(DVec3::new(x, y, z));
    let ball = |radius: f64| Shape::Ball(DVec3::splat(radius));
    vec![
        // Two touching objects in a bin, visible only from above.
        ("bin", Shape::Bin(DVec3::new(0.42, 0.36, 0.26), 0.04), [0.0, 0.0, 0.26], 0.0, Pattern::Checks(0.15)),
        ("apple", ball(0.13), [-0.12, 0.02, 0.17], 0.0, Pattern::Noise(0.12)),
        ("die", block(0.11, 0.11, 0.1), [0.12, 0.02, 0.14], 0.0, Pattern::Spots(0.09)),
        // Thin parts: bars in front of the ground, a wire between two poles.
        ("fence", Shape::Fence(9, 0.14, 0.38, THIN_RADIUS), [0.05, -1.0, 0.38], 0.0, Pattern::Stripes(0.2, 2)),
        (
            "wire",
            Shape::RoundBlock(DVec3::new(0.8, 0.0, 0.0), THIN_RADIUS),
            [0.0, 0.8, 1.25],
            0.0,
            Pattern::Stripes(0.3, 0),
        ),
        // Objects cut by the image border: the taller pole at the top, the plank on both sides.
        ("mast", Shape::Cylinder(0.08, 1.25), [-0.88, 0.8, 1.25], 0.0, Pattern::Stripes(0.25, 2)),
        ("pole", Shape::Cylinder(0.08, 0.66), [0.88, 0.8, 0.66], 0.0, Pattern::Stripes(0.25, 2)),
        ("plank", block(2.3, 0.15, 0.05), [0.0, 1.45, 0.05], 0.0, Pattern::Stripes(0.3, 0)),
        // Twins, face to face, on the plank.
        ("brick", block(0.16, 0.1, 0.09), [-0.16, 1.45, 0.19], 0.0, Pattern::Checks(0.11)),
        ("twin", block(0.16, 0.1, 0.09), [0.16, 1.45, 0.19], 0.0, Pattern::Checks(0.11)),
        // Objects with the colours of other things.
        ("flagstone", block(0.3, 0.26, 0.015), [0.95, -0.35, 0.015], 0.0, Pattern::Ground),
        ("coal", ball(0.22), [-0.95, -0.3, 0.22], 0.0, Pattern::Plain),
    ]
}
