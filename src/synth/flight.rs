//! Cameras above a city and in its streets.

use super::land::{PLOT_COLUMNS, PLOT_PITCH, PLOT_ROWS};
use super::{SynthOptions, hash01};
use glam::DVec3;

/// Every third photo is taken from a street.
const STREETS_EVERY: u32 = 3;
/// Smallest distance of the other cameras from their targets, world units. The distance is larger if there are few
/// photos, so that they overlap.
const DISTANCE_MIN: f64 = 8.5;
/// Largest distance of these cameras.
const DISTANCE_MAX: f64 = 16.0;
/// Number of photos that overlap enough at the smallest distance.
const OVERLAP_COUNT: f64 = 120.0;
/// Half the size of the city, world units.
const HALF_SIZE: DVec3 = DVec3::new(PLOT_COLUMNS as f64 * PLOT_PITCH / 2.0, PLOT_ROWS as f64 * PLOT_PITCH / 2.0, 0.0);

/// Returns the position of a view and the unit vector along its optical axis.
pub(super) fn pose(options: &SynthOptions, view: u32) -> (DVec3, DVec3) {
    let (before, streets) = ((view + 1) / STREETS_EVERY, options.views / STREETS_EVERY);
    if view % STREETS_EVERY == STREETS_EVERY - 1 {
        return in_street(options, view, f64::from(view / STREETS_EVERY) / f64::from(streets));
    }
    let jitter = |what: u64| hash01(options.seed, 3, u64::from(view), what) - 0.5;
    let count = f64::from(options.views - streets);
    // Targets and azimuths come from sequences that cover the city evenly for any number of photos.
    let index = f64::from(view - before) + 0.5;
    let spread = |step: f64| 2.0 * (index * step).fract() - 1.0;
    let target =
        HALF_SIZE * DVec3::new(0.97 * spread(0.754_877_666_2), 0.95 * spread(0.569_840_291_0), 0.0) + DVec3::Z * 0.4;
    let azimuth = std::f64::consts::PI * spread(0.618_033_988_7) + 0.3 * jitter(0);
    let elevation = (46.0 + 18.0 * jitter(1)).to_radians();
    let outward = DVec3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
    let distance =
        (DISTANCE_MIN * (OVERLAP_COUNT / count).sqrt()).clamp(DISTANCE_MIN, DISTANCE_MAX) * (1.0 + 0.1 * jitter(2));
    (target + outward * distance, -outward)
}

/// Returns a pose in a street between plots; `share`, 0 to 1, is the position along a path through all streets.
fn in_street(options: &SynthOptions, view: u32, share: f64) -> (DVec3, DVec3) {
    let jitter = |what: u64| hash01(options.seed, 3, u64::from(view), what) - 0.5;
    // Streets along x, then streets along y.
    let (rows, columns) = (PLOT_ROWS - 1, PLOT_COLUMNS - 1);
    let way = f64::from(rows) * 2.0 * HALF_SIZE.x + f64::from(columns) * 2.0 * HALF_SIZE.y;
    let (mut at, mut street, mut length) = (share * way, 0, 2.0 * HALF_SIZE.x);
    while at >= length && street + 1 < rows + columns {
        at -= length;
        street += 1;
        length = if street < rows { 2.0 * HALF_SIZE.x } else { 2.0 * HALF_SIZE.y };
    }
    let (along, aside) = if street < rows { (DVec3::X, DVec3::Y) } else { (DVec3::Y, DVec3::X) };
    let (index, count) = if street < rows { (street, rows) } else { (street - rows, columns) };
    let middle = (f64::from(index) - f64::from(count - 1) / 2.0) * PLOT_PITCH;
    let position =
        along * (at - length / 2.0) + aside * (middle + 0.15 * jitter(0)) + DVec3::Z * (1.1 + 0.3 * jitter(1));
    // Near the end of a street the camera looks back into it.
    let turn = view / STREETS_EVERY;
    let is_back = at > 0.65 * length || (at > 0.35 * length && turn % 2 == 1);
    let yaw = (if (turn / 2).is_multiple_of(2) { 32.0_f64 } else { -32.0 } + 20.0 * jitter(2)).to_radians();
    let level = (along * yaw.cos() + aside * yaw.sin()) * if is_back { -1.0 } else { 1.0 };
    let pitch = (-9.0 + 6.0 * jitter(3)).to_radians();
    (position, level * pitch.cos() + DVec3::Z * pitch.sin())
}
