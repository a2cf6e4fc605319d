//! What the views show at a place on a plane.

use super::Sight;
use super::plane::Plane;
use glam::DVec3;

/// Tolerance of depths, in cells.
const DEPTH_TOLERANCE: f64 = 2.5;
/// Distance from the surface in question, and depth below any, that still counts as that surface, in tolerances: where
/// little is seen, as in shadows and corners, surfaces of a model are uneven.
const OWN_SURFACE_TOLERANCES: f64 = 3.0;
/// Least sine of the angle between a view and the plane: a flatter one cannot tell its places apart.
const VIEW_SINE_MIN: f64 = 0.15;
/// Views that have to show the removed object before a hole.
const HIDING_VIEWS_MIN: u32 = 2;
/// Share of these views that may show something else: at contours a pixel is decided by chance.
const OTHER_VIEWS_SHARE_MAX: f64 = 0.1;

/// Returns the distance up to which something is on a surface, world units.
pub(super) fn on_surface(cell: f64) -> f64 {
    OWN_SURFACE_TOLERANCES * DEPTH_TOLERANCE * cell
}

/// What a view shows at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// The removed object is there or before it.
    Removed,
    /// A surface is there.
    Surface,
    /// The view looks through the place.
    Through,
    /// Something else is before it.
    Hidden,
}

/// What all views show at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// The surface in question.
    Seen,
    /// Nothing.
    Free,
    /// Nothing but the removed object was ever seen here.
    Hole,
    /// Other things are there or hide it, or no view has it.
    Unknown,
}

/// Numbers of views.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    removed: u32,
    surface: u32,
    through: u32,
    /// Views of the surface in question, part of those of any surface.
    pub own: u32,
}

impl Evidence {
    /// Adds what a view shows at a place on a plane, the surface of the label `own`, and returns its pixel. Depths are
    /// compared at the middle of the pixel, because a flat view changes them much within it.
    pub(super) fn add(
        &mut self,
        world: DVec3,
        (plane, own): (&Plane, u32),
        cell: f64,
        removed: &[u32],
        sight: &Sight,
    ) -> Option<(usize, Shown)> {
        let camera = &sight.camera;
        let pixel = camera.sees(world)?;
        let index = pixel.y as usize * camera.width as usize + pixel.x as usize;
        let ray = camera.rotation.transpose() * camera.ray(camera.pixel_centre(index));
        let depth = -plane.height(camera.centre()) / ray.dot(plane.normal);
        if ray.normalize().dot(plane.normal).abs() < VIEW_SINE_MIN || !(depth > 0.0 && depth.is_finite()) {
            return None;
        }
        let shown = f64::from(sight.depth[index]);
        let behind = if shown > 0.0 { depth - shown } else { f64::NEG_INFINITY };
        // Distance from the plane of the surface that the view shows: flat views change depths much from pixel to
        // pixel.
        let off = if shown > 0.0 { plane.height(sight.at(index, shown)).abs() } else { f64::INFINITY };
        let slack = DEPTH_TOLERANCE * cell;
        let label = u32::from(sight.labels.ids[index]);
        let is_removed = removed.contains(&label);
        let (shown, count) = if is_removed && (behind >= -slack || off <= on_surface(cell)) {
            (Shown::Removed, Some(&mut self.removed))
        } else if !is_removed && off <= if label == own { on_surface(cell) } else { slack } {
            (Shown::Surface, Some(&mut self.surface))
        } else if behind < -slack {
            (Shown::Through, Some(&mut self.through))
        } else if !is_removed && behind <= on_surface(cell) {
            (Shown::Hidden, Some(&mut self.surface))
        } else {
            (Shown::Hidden, None)
        };
        if let Some(count) = count {
            *count += 1;
        }
        Some((index, shown))
    }

    /// Adds what a view shows at a point of space: the removed object there or before it, something else there, or
    /// something behind it.
    pub(super) fn add_point(&mut self, world: DVec3, cell: f64, removed: &[u32], sight: &Sight) {
        let camera = &sight.camera;
        let Some(pixel) = camera.sees(world) else { return };
        let index = pixel.y as usize * camera.width as usize + pixel.x as usize;
        let shown = f64::from(sight.depth[index]);
        let behind = if shown > 0.0 { camera.to_camera(world).z - shown } else { f64::NEG_INFINITY };
        let slack = DEPTH_TOLERANCE * cell;
        if behind < -slack {
            self.through += 1;
        } else if removed.contains(&u32::from(sight.labels.ids[index])) {
            self.removed += 1;
        } else if behind <= on_surface(cell) {
            self.surface += 1;
        }
    }

    /// Returns the share of the views of the surface in question among these and those of the removed object.
    pub(super) fn share(&self) -> f64 {
        f64::from(self.own) / f64::from((self.own + self.removed).max(1))
    }

    /// Returns what the views show together.
    pub(super) fn state(&self) -> State {
        let other = self.surface + self.through;
        if self.removed >= HIDING_VIEWS_MIN && f64::from(other) <= OTHER_VIEWS_SHARE_MAX * f64::from(self.removed) {
            State::Hole
        } else if self.own > self.through {
            State::Seen
        } else if self.through > 0 {
            State::Free
        } else {
            State::Unknown
        }
    }
}
