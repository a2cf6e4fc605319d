//! A pinhole camera with an off-centre principal point.
//!
//! Axes are OpenCV's: x right, y down, z forward. The centre of pixel (0, 0) is at (0.5, 0.5), so a point (x, y, z) in
//! camera space projects to (fx x/z + cx, fy y/z + cy).

use glam::{DMat3, DQuat, DVec2, DVec3};

/// Pose and intrinsics of one view, in f64.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Rotation of camera-from-world.
    pub rotation: DMat3,
    /// Translation of camera-from-world, world units.
    pub translation: DVec3,
    /// Horizontal focal length, px.
    pub fx: f64,
    /// Vertical focal length, px.
    pub fy: f64,
    /// Principal point x, px.
    pub cx: f64,
    /// Principal point y, px.
    pub cy: f64,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
}

impl Camera {
    /// Returns a camera at the world's origin, along its axes. Intrinsics are fx, fy, cx and cy, px; size is width and
    /// height, px.
    pub fn at_origin([fx, fy, cx, cy]: [f64; 4], (width, height): (u32, u32)) -> Self {
        Self { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, fx, fy, cx, cy, width, height }
    }

    /// Returns width and height of the image, px.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the direction of the optical axis in world space.
    pub fn axis(&self) -> DVec3 {
        self.rotation.row(2)
    }

    /// Returns the camera moved to `centre`, looking along `forward` with `up` above. If these are parallel, another
    /// direction is up.
    pub fn placed(&self, centre: DVec3, forward: DVec3, up: DVec3) -> Self {
        let forward = forward.normalize();
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        // Rows of the rotation: right, down, forward.
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        Self { rotation, translation: -(rotation * centre), ..self.clone() }
    }

    /// Returns the centre of the camera in world space.
    pub fn centre(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// Returns the camera in a world with its origin moved to `origin`.
    pub fn relative_to(&self, origin: DVec3) -> Self {
        Self { translation: self.to_camera(origin), ..self.clone() }
    }

    /// Returns the camera-space position of a world point.
    pub fn to_camera(&self, world: DVec3) -> DVec3 {
        self.rotation * world + self.translation
    }

    /// Projects a camera-space point, px. The result is only meaningful for z > 0.
    pub fn project(&self, camera: DVec3) -> DVec2 {
        DVec2::new(self.fx * camera.x / camera.z + self.cx, self.fy * camera.y / camera.z + self.cy)
    }

    /// Returns the direction of the ray through a point in the image, px: camera space, with z = 1.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        DVec3::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy, 1.0)
    }

    /// Returns the world point at a depth, world units along the optical axis, behind a point in the image, px.
    pub fn unproject(&self, pixel: DVec2, depth: f64) -> DVec3 {
        self.rotation.transpose() * (self.ray(pixel) * depth - self.translation)
    }

    /// Returns the centre of a pixel, px, from its row-major index.
    pub fn pixel_centre(&self, index: usize) -> DVec2 {
        let width = self.width as usize;
        DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5)
    }

    /// Returns the position of a world point in the image, px, or `None` if it is outside.
    pub fn sees(&self, world: DVec3) -> Option<DVec2> {
        let at = self.to_camera(world);
        let pixel = self.project(at);
        let inside = at.z > 0.0
            && (0.0..f64::from(self.width)).contains(&pixel.x)
            && (0.0..f64::from(self.height)).contains(&pixel.y);
        inside.then_some(pixel)
    }

    /// Returns the camera turned around its centre by a Rodrigues vector in camera space, and moved by `shift`, world
    /// units. The tangent of half the angle is half the vector's length, so for small turns the length is the angle in
    /// radians.
    pub fn corrected(&self, turn: DVec3, shift: DVec3) -> Self {
        let half = 0.5 * turn;
        let rotation = DMat3::from_quat(DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize()) * self.rotation;
        let translation = -(rotation * (self.centre() + shift));
        Self { rotation, translation, ..self.clone() }
    }

    /// Returns the camera for an image resized to `width` x `height` px.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let (sx, sy) = (f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height));
        Self { fx: self.fx * sx, fy: self.fy * sy, cx: self.cx * sx, cy: self.cy * sy, width, height, ..self.clone() }
    }

    /// Returns the camera for a crop of the image with a given size, whose upper left pixel is (`left`, `top`).
    pub fn cut(&self, (left, top): (u32, u32), (width, height): (u32, u32)) -> Self {
        Self { cx: self.cx - f64::from(left), cy: self.cy - f64::from(top), width, height, ..self.clone() }
    }

    /// Returns the camera for an image scaled by `share`, at most 1.
    pub fn shrunk(&self, share: f64) -> Self {
        self.resized(side_at(self.width, share), side_at(self.height, share))
    }
}

/// Returns the side of an image scaled by `share`, at least 1 px.
pub fn side_at(full: u32, share: f64) -> u32 {
    ((f64::from(full) * share).round() as u32).clamp(1, full)
}
