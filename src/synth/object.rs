//! A labelled object of a made scene.

use super::material::{Material, Pattern};
use super::shape::Shape;
use glam::{DQuat, DVec3};

/// One row of an arrangement: name, shape, position, turn about z in degrees, pattern.
pub(super) type Row = (&'static str, Shape, [f64; 3], f64, Pattern);

/// A labelled object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Id in the masks, from 1.
    pub id: u8,
    /// Name.
    pub name: &'static str,
    /// Shape in its own frame.
    pub shape: Shape,
    /// Centre, world.
    pub position: DVec3,
    /// World from own frame.
    pub rotation: DQuat,
    /// Colour.
    pub material: Material,
}

impl Object {
    /// Place and direction in the object's own frame.
    pub(super) fn to_own(&self, origin: DVec3, direction: DVec3) -> (DVec3, DVec3) {
        let back = self.rotation.conjugate();
        (back * (origin - self.position), back * direction)
    }

    /// Distance at which a ray meets the object alone.
    pub fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let (origin, direction) = self.to_own(origin, direction);
        self.shape.enter(origin, direction).map(|entry| entry.distance)
    }
}
