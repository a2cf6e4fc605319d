//! The ground under the objects, and the sky above them.

use super::Preset;
use super::material::{ground_albedo, noise};
use super::turntable::STAND_RADIUS;
use glam::DVec3;

/// Plots of the city along x and along y; the world's origin is at the centre.
pub(super) const PLOT_COLUMNS: u32 = 6;
pub(super) const PLOT_ROWS: u32 = 4;
/// Distance between the centre lines of neighbouring streets, world units.
pub(super) const PLOT_PITCH: f64 = 4.0;
/// Half the width of a street, world units.
pub(super) const STREET_HALF_WIDTH: f64 = 0.65;

/// Ground and sky of a scene. Lengths are world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Land {
    /// Radius of the sky, a real surface around the scene, so that its distance can be learned.
    pub(super) sky: f64,
    /// Radii between which the ground fades to the colour of the horizon.
    pub(super) haze: (f64, f64),
    pub(super) has_streets: bool,
    /// Whether a white wall replaces the sky, with a stand on white ground.
    pub(super) is_studio: bool,
    pub(super) has_ground: bool,
}

/// Colour of the wall in a studio.
pub(super) const WALL_COLOUR: DVec3 = DVec3::new(0.95, 0.94, 0.92);

impl Land {
    /// Returns the land of a preset.
    pub(super) fn new(preset: Preset) -> Self {
        match preset {
            Preset::City => {
                Self { sky: 36.0, haze: (15.0, 28.0), has_streets: true, is_studio: false, has_ground: true }
            }
            // Nothing surrounds the object: photos show it in a room.
            Preset::Turntable | Preset::TurnedOver => {
                Self { sky: 9.0, haze: (1.2, 3.0), has_streets: false, is_studio: true, has_ground: false }
            }
            _ => Self { sky: 9.0, haze: (2.2, 6.5), has_streets: false, is_studio: false, has_ground: true },
        }
    }

    /// Returns the albedo of the ground at a world position.
    pub(super) fn albedo(&self, place: DVec3, seed: u64) -> DVec3 {
        if self.is_studio {
            let is_stand = place.truncate().length() < STAND_RADIUS;
            return if is_stand {
                DVec3::new(0.5, 0.45, 0.4) * (0.7 + 0.6 * noise(place / 0.2, seed + 79))
            } else {
                WALL_COLOUR
            };
        }
        let street = if self.has_streets { street(place, seed) } else { None };
        street.unwrap_or_else(|| ground_albedo(place, seed))
    }
}

/// Returns the albedo of a street with a dashed centre line; `None` beside it.
fn street(place: DVec3, seed: u64) -> Option<DVec3> {
    let reach = |count: u32| f64::from(count) / 2.0 * PLOT_PITCH + STREET_HALF_WIDTH;
    if place.x.abs() > reach(PLOT_COLUMNS) || place.y.abs() > reach(PLOT_ROWS) {
        return None;
    }
    let from_middle = |at: f64| (at - (at / PLOT_PITCH).round() * PLOT_PITCH).abs();
    let (x, y) = (from_middle(place.x), from_middle(place.y));
    if x.min(y) > STREET_HALF_WIDTH {
        return None;
    }
    let is_crossing = x.max(y) < STREET_HALF_WIDTH;
    let along = if x < y { place.y } else { place.x };
    let is_line = !is_crossing && x.min(y) < 0.04 && (along / 0.4).floor().rem_euclid(2.0) < 1.0;
    let base = if is_line { DVec3::splat(0.8) } else { DVec3::new(0.3, 0.31, 0.34) };
    Some(base * (0.7 + 0.6 * noise(place / 0.3, seed + 78)))
}
