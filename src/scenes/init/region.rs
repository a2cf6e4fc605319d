//! The region that the cameras of a scene see.

use glam::{DVec2, DVec3};
use labelgs_scene::median::median;
use labelgs_scene::{Camera, View, overview};

/// The region to fill with Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Region {
    /// For cameras around a subject: a ball around the point nearest to all optical axes. The typical camera sees it
    /// completely.
    Ball {
        /// Centre, world position.
        centre: DVec3,
        /// Radius, world units.
        radius: f64,
        /// Typical distance of a camera from the centre, world units.
        distance: f64,
    },
    /// For cameras with parallel or outward axes: the space in front of them between two depths.
    Frusta {
        /// Smallest depth, world units.
        near: f64,
        /// Largest depth, world units.
        far: f64,
    },
}

impl Region {
    /// Returns the depth range of the scene in front of a camera.
    pub(super) fn depths(&self) -> (f64, f64) {
        match *self {
            Self::Ball { radius, distance, .. } => (0.4 * distance, 5.0 * (distance + radius)),
            Self::Frusta { near, far } => (near, far),
        }
    }
}

/// Returns the smallest extent of the longer image side at `point` over all views that see it, world units; infinite if
/// none does.
pub(super) fn image_side(views: &[View], point: DVec3) -> f64 {
    let side = |camera: &Camera| {
        let sizes = DVec2::new(f64::from(camera.width) / camera.fx, f64::from(camera.height) / camera.fy);
        camera.sees(point).map(|_| camera.to_camera(point).z * sizes.max_element())
    };
    views.iter().filter_map(|view| side(&view.camera)).fold(f64::INFINITY, f64::min)
}

/// Returns the sine of the angle from the optical axis to the nearest edge of the image.
fn narrow_sine(camera: &Camera) -> f64 {
    let side = |f: f64, c: f64, size: u32| c.min(f64::from(size) - c).max(0.0) / f;
    let tangent = side(camera.fx, camera.cx, camera.width).min(side(camera.fy, camera.cy, camera.height));
    tangent / (1.0 + tangent * tangent).sqrt()
}

/// Finds the region of `views`; `extent` is the radius of their cameras.
pub(super) fn find(views: &[View], extent: f64) -> Region {
    let cameras: Vec<&Camera> = views.iter().map(|view| &view.camera).collect();
    if let Some(centre) = nearest_to_axes(&cameras) {
        let inward = cameras.iter().filter(|camera| camera.sees(centre).is_some()).count();
        let radius = median(cameras.iter().map(|c| c.centre().distance(centre) * narrow_sine(c))).unwrap_or(0.0);
        let distance = median(cameras.iter().map(|c| c.centre().distance(centre))).unwrap_or(0.0);
        // Cameras that rotate in one place differ only by rounding errors, which give no distance.
        if inward * 4 >= cameras.len() * 3 && radius > 1e-6 * extent {
            return Region::Ball { centre, radius, distance };
        }
    }
    // Only the spread of the cameras gives a scale. Depths are 1 to 50 times that, uniform in inverse depth, so that
    // parallax is uniform too.
    Region::Frusta { near: extent, far: 50.0 * extent }
}

/// Returns the point with the smallest sum of squared distances to the optical axes, if it is well determined.
fn nearest_to_axes(cameras: &[&Camera]) -> Option<DVec3> {
    let (mut matrix, mut right) = overview::nearest_to_axes(cameras.iter().copied());
    matrix *= 1.0 / cameras.len().max(1) as f64;
    right /= cameras.len().max(1) as f64;
    // The matrix has trace 2. Its determinant is 0 for parallel axes and 0.01 for axes within 6 degrees of a common
    // one.
    (matrix.determinant() > 0.01).then(|| matrix.inverse() * right)
}
