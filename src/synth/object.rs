//! A labelled object of a synthetic scene.

use super::material::{Material, Pattern};
use super::shape::Shape;
use glam::{DQuat, DVec3};

/// A row of a preset: name, shape, position, rotation about z in degrees, pattern.
pub(super) type Row = (&'static str, Shape, [f64; 3], f64, Pattern);

/// A labelled object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Id in the masks, from 1.
    pub id: u8,
    /// Name.
    pub name: &'static str,
    /// Shape, in the object's frame.
    pub shape: Shape,
    /// Centre, world position.
    pub position: DVec3,
    /// Rotation from the object's frame to the world.
    pub rotation: DQuat,
    /// Colours.
    pub material: Material,
}

impl Object {
    /// Converts the position and direction of a ray to the object's frame.
    pub(super) fn to_own(&self, origin: DVec3, direction: DVec3) -> (DVec3, DVec3) {
        let back = self.rotation.conjugate();
        (back * (origin - self.position), back * direction)
    }

    /// Returns false for most rays that miss the object, by a bounding sphere.
    pub(super) fn may_meet(&self, origin: DVec3, direction: DVec3) -> bool {
        let to = self.position - origin;
        let along = to.dot(direction);
        // Slightly larger than the shape's own bounding sphere, which then decides.
        let bound = self.shape.bound() * 1.001;
        to.length_squared() - along * along <= bound * bound && along > -bound
    }

    /// Returns the distance of a world position to the surface, negative inside.
    pub fn distance_to(&self, place: DVec3) -> f64 {
        self.shape.distance_to(self.to_own(place, DVec3::ZERO).0)
    }

    /// Returns the distance at which a ray hits the object, ignoring all others.
    pub fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        if !self.may_meet(origin, direction) {
            return None;
        }
        let (origin, direction) = self.to_own(origin, direction);
        self.shape.enter(origin, direction).map(|entry| entry.distance)
    }
}
