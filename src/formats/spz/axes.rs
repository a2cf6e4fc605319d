//! The axes of an SPZ: right, up, back, unless a record says others.

use crate::transform::Transform;
use crate::turn::Signs;
use glam::DQuat;
use std::f64::consts::FRAC_PI_2;

/// Bits of a record's value less 1: x is right, the axis of height is up, that of depth is front. In the second half of
/// the values z is the axis of height.
const RIGHT: u32 = 1;
const UP: u32 = 2;
const FRONT: u32 = 4;
const Z_IS_HEIGHT: u32 = 8;
/// Largest value of a record. 0 is none of them.
const VALUE_MAX: u32 = 16;

/// How the axes of a file become ours: first signs, then a quarter turn about x.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileAxes {
    pub(super) signs: Signs,
    pub(super) is_turned: bool,
}

impl Default for FileAxes {
    fn default() -> Self {
        Self { signs: super::AXES, is_turned: false }
    }
}

impl FileAxes {
    /// The axes of a record; `None` for an unknown value.
    pub(super) fn of_record(value: u32) -> Option<Self> {
        if value == 0 || value > VALUE_MAX {
            return (value == 0).then(Self::default);
        }
        let sign = |bit: u32| if (value - 1) & bit == 0 { -1.0 } else { 1.0 };
        let is_turned = (value - 1) & Z_IS_HEIGHT != 0;
        // Ours are right, down, front. The quarter turn makes -z, which is up for a z that is down, our y.
        let signs =
            if is_turned { [sign(RIGHT), sign(FRONT), sign(UP)] } else { [sign(RIGHT), -sign(UP), sign(FRONT)] };
        Some(Self { signs: Signs(signs), is_turned })
    }

    /// The turn after the signs, if there is one.
    pub(super) fn turn(self) -> Option<Transform> {
        let turn = DQuat::from_rotation_x(FRAC_PI_2);
        self.is_turned.then(|| Transform { turn, ..Transform::default() })
    }
}
