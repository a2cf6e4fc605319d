//! Reads the transform of a prim: the operations of `UsdGeomXformable`.

use super::text::{Scanner, Span};
use glam::{DMat4, DQuat, DVec3};
use labelgs_scene::Result;
use std::collections::BTreeMap;

/// Prefix of all transform attributes.
pub(super) const XFORM_PREFIX: &str = "xformOp";
const ORDER_ATTRIBUTE: &str = "xformOpOrder";
const INVERSE_PREFIX: &str = "!invert!";
const RESET_MARK: &str = "!resetXformStack!";

/// Returns the matrix of a prim relative to its parent, and whether the prim resets the parent's transform.
pub(super) fn local(scanner: &Scanner, prim: usize, attributes: &BTreeMap<&str, Span>) -> Result<(DMat4, bool)> {
    let (mut matrix, mut is_free) = (DMat4::IDENTITY, false);
    let Some(&order) = attributes.get(ORDER_ATTRIBUTE) else { return Ok((matrix, is_free)) };
    let mut names = scanner.within(order);
    names.take(b'[');
    // The first operation is the outermost one.
    while matches!(names.peek(), Some(b'"' | b'\'')) {
        let own = names.string()?;
        names.take(b',');
        if own == RESET_MARK {
            (matrix, is_free) = (DMat4::IDENTITY, true);
            continue;
        }
        let name = own.strip_prefix(INVERSE_PREFIX).unwrap_or(own);
        let Some(&value) = attributes.get(name) else {
            let problem =
                format!("is moved by {name}, which has no value or one that changes with time; export a static scene");
            return Err(scanner.bad(prim, problem));
        };
        let numbers: Vec<f64> = scanner.numbers(value)?;
        let kind = name.split(':').nth(1).unwrap_or_default();
        let Some(operation) = operation(kind, &numbers) else {
            let problem = format!("has an unknown operation {name} with {} numbers; bake it in", numbers.len());
            return Err(scanner.bad(value.start, problem));
        };
        matrix *= if own == name { operation } else { operation.inverse() };
    }
    Ok((matrix, is_free))
}

/// Returns the matrix of an operation, or `None` for an unknown operation or a wrong number of values.
fn operation(kind: &str, numbers: &[f64]) -> Option<DMat4> {
    let along = |axis: u8, value: f64, usual: f64| {
        let mut triple = DVec3::splat(usual);
        *triple.as_mut().get_mut(usize::from(axis - b'X'))? = value;
        Some(triple)
    };
    let about = |axis: u8, degrees: f64| match axis {
        b'X' => DMat4::from_rotation_x(degrees.to_radians()),
        b'Y' => DMat4::from_rotation_y(degrees.to_radians()),
        _ => DMat4::from_rotation_z(degrees.to_radians()),
    };
    let is_axes = |axes: &[u8]| axes.iter().all(|axis| (b'X'..=b'Z').contains(axis));
    let split = kind.find(|c: char| c.is_ascii_uppercase()).unwrap_or(kind.len());
    let (verb, axes) = (kind.get(..split)?, kind.get(split..)?.as_bytes());
    match (verb, axes, numbers) {
        ("translate", [], &[x, y, z]) => Some(DMat4::from_translation(DVec3::new(x, y, z))),
        ("scale", [], &[x, y, z]) => Some(DMat4::from_scale(DVec3::new(x, y, z))),
        ("translate", &[axis], &[value]) if is_axes(axes) => Some(DMat4::from_translation(along(axis, value, 0.0)?)),
        ("scale", &[axis], &[value]) if is_axes(axes) => Some(DMat4::from_scale(along(axis, value, 1.0)?)),
        ("rotate", &[axis], &[degrees]) if is_axes(axes) => Some(about(axis, degrees)),
        // The first axis turns first; the numbers are in the order x, y, z.
        ("rotate", &[a, b, c], &[_, _, _]) if is_axes(axes) => {
            let turn = |axis: u8| about(axis, numbers[usize::from(axis - b'X')]);
            Some(turn(c) * turn(b) * turn(a))
        }
        ("orient", [], &[w, x, y, z]) => Some(DMat4::from_quat(DQuat::from_xyzw(x, y, z, w).normalize())),
        // USD's rows are columns here.
        ("transform", [], _) => Some(DMat4::from_cols_array(numbers.try_into().ok()?)),
        _ => None,
    }
}
