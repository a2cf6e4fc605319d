//! A box with axes of its own.

use glam::DVec3;

/// A box with axes of its own: `low <= position < high` along each. A side at infinity is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    /// Orthogonal unit vectors in the world.
    pub axes: [DVec3; 3],
    /// Smaller corner along the axes, world units.
    pub low: DVec3,
    /// Larger corner, exclusive.
    pub high: DVec3,
}

impl Zone {
    /// Creates a box along the world axes from its corners x0, y0, z0, x1, y1, z1.
    pub const fn along_world([x0, y0, z0, x1, y1, z1]: [f64; 6]) -> Self {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        Self { axes, low: DVec3::new(x0, y0, z0), high: DVec3::new(x1, y1, z1) }
    }

    /// Returns the coordinates of a world point along the box's axes.
    pub fn to_axes(&self, world: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(world)))
    }

    /// Returns true if a world point is inside the box.
    pub fn contains(&self, world: DVec3) -> bool {
        let place = self.to_axes(world);
        place.cmpge(self.low).all() && place.cmplt(self.high).all()
    }
}
