//! The axes of an SPZ: right, up, back, unless a record specifies others.

use crate::axis_signs::Signs;
use crate::transform::Transform;
use glam::DQuat;
use std::f64::consts::FRAC_PI_2;

/// Bits of a record's value minus 1: x points right, the height axis points up, the depth axis points to the front. In
/// the upper half of the values, z is the height axis.
const RIGHT_BIT: u32 = 1;
const UP_BIT: u32 = 2;
const FRONT_BIT: u32 = 4;
const HEIGHT_IS_Z_BIT: u32 = 8;
/// Largest value of a record; 0 is invalid.
const VALUE_MAX: u32 = 16;

/// How to convert a file's axes to ours: signs, then a quarter turn about x.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileAxes {
    pub(super) signs: Signs,
    pub(super) is_turned: bool,
}

impl Default for FileAxes {
    fn default() -> Self {
        Self { signs: super::SPZ_AXES, is_turned: false }
    }
}

impl FileAxes {
    /// Returns the axes of a record, or `None` for an unknown value.
    pub(super) fn from_record(value: u32) -> Option<Self> {
        if value == 0 || value > VALUE_MAX {
            return (value == 0).then(Self::default);
        }
        let sign = |bit: u32| if (value - 1) & bit == 0 { -1.0 } else { 1.0 };
        let is_turned = (value - 1) & HEIGHT_IS_Z_BIT != 0;
        // Ours are right, down, front. The quarter turn maps -z, which is up if z is down, to our y.
        let signs = if is_turned {
            [sign(RIGHT_BIT), sign(FRONT_BIT), sign(UP_BIT)]
        } else {
            [sign(RIGHT_BIT), -sign(UP_BIT), sign(FRONT_BIT)]
        };
        Some(Self { signs: Signs(signs), is_turned })
    }

    /// Returns the turn after the signs, if there is one.
    pub(super) fn turn(self) -> Option<Transform> {
        let turn = DQuat::from_rotation_x(FRAC_PI_2);
        self.is_turned.then(|| Transform { turn, ..Transform::default() })
    }
}
