//! Solid textures: colour as a function of the position in the object's frame. The finest patterns are a few pixels
//! wide in a typical view.

use super::hash01;
use glam::DVec3;

/// The pattern of the two colours of a material. Lengths are world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Cubes with this edge.
    Checks(f64),
    /// Slabs with this thickness across an axis (0, 1, 2).
    Stripes(f64, usize),
    /// Wedges around the z axis, with this number of each colour.
    Wedges(u32),
    /// Smooth noise with this wavelength.
    Noise(f64),
    /// Balls on a grid with this pitch.
    Spots(f64),
    /// Only the first colour.
    Plain,
    /// The pattern of the ground, for an object without rotation whose offset is its position.
    Ground,
}

/// The colours of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Pattern of the two colours.
    pub pattern: Pattern,
    /// First colour, r, g, b, 0 to 1.
    pub first: DVec3,
    /// Second colour, r, g, b, 0 to 1.
    pub second: DVec3,
    /// Shift of the pattern, world units. It also keeps pattern edges off the faces of a box.
    pub offset: DVec3,
    /// Seed of the noise.
    pub seed: u64,
}

impl Material {
    /// Returns the albedo at a position in the object's frame.
    pub fn albedo(&self, place: DVec3) -> DVec3 {
        let p = place + self.offset;
        let share = match self.pattern {
            Pattern::Ground => return ground_albedo(p, self.seed),
            Pattern::Plain => 0.0,
            Pattern::Checks(edge) => (p / edge).floor().element_sum().rem_euclid(2.0),
            Pattern::Stripes(width, axis) => (p[axis] / width).floor().rem_euclid(2.0),
            Pattern::Wedges(count) => {
                let turns = place.y.atan2(place.x) / std::f64::consts::TAU;
                (turns * f64::from(2 * count) + 0.3).floor().rem_euclid(2.0)
            }
            Pattern::Noise(wavelength) => {
                let t = 0.7 * noise(p / wavelength, self.seed) + 0.3 * noise(p / wavelength * 2.0, self.seed + 1);
                // Value noise stays near its mean; stretch it.
                ((t - 0.5) * 3.0 + 0.5).clamp(0.0, 1.0)
            }
            Pattern::Spots(pitch) => {
                let cell = p / pitch;
                f64::from((cell - cell.floor() - 0.5).length() < 0.42)
            }
        };
        // A slow change of brightness makes all patches different.
        let shade = 0.88 + 0.24 * noise(p / 0.45, self.seed + 2);
        self.first.lerp(self.second, share) * shade
    }
}

/// Returns the albedo of the ground at a world position; the seed is that of the world.
pub(super) fn ground_albedo(place: DVec3, seed: u64) -> DVec3 {
    let tile = (place / 0.55 + 0.21).floor();
    let odd = (tile.x + tile.y).rem_euclid(2.0);
    let base = DVec3::new(0.62, 0.58, 0.5).lerp(DVec3::new(0.46, 0.47, 0.45), odd);
    base * (0.75 + 0.5 * noise(place / 0.35, seed + 77))
}

/// Returns value noise in 0 to 1: one random value per lattice point, smooth in between.
pub(super) fn noise(p: DVec3, seed: u64) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (3.0 - 2.0 * f);
    let corner = |dx: f64, dy: f64, dz: f64| {
        let word = |value: f64| (value as i64) as u64;
        hash01(word(cell.x + dx), word(cell.y + dy), word(cell.z + dz), seed)
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |dy: f64, dz: f64| mix(corner(0.0, dy, dz), corner(1.0, dy, dz), s.x);
    let side = |dz: f64| mix(edge(0.0, dz), edge(1.0, dz), s.y);
    mix(side(0.0), side(1.0), s.z)
}

/// Returns a colour from hue (0 to 1, periodic), saturation and value.
pub(super) fn hsv(hue: f64, saturation: f64, value: f64) -> DVec3 {
    let channel = |offset: f64| {
        let k = (offset + hue.rem_euclid(1.0) * 6.0) % 6.0;
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    DVec3::new(channel(5.0), channel(3.0), channel(1.0))
}
