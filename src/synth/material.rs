//! Solid textures: colour as a function of the place in an object's own frame. No pattern is finer than a few pixels of
//! the usual view.

use super::hash01;
use glam::DVec3;

/// How the two colours of a material share the space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Cubes of this edge.
    Checks(f64),
    /// Slabs of this thickness across an axis (0, 1, 2).
    Stripes(f64, usize),
    /// Wedges around the z axis, this many of each colour.
    Wedges(u32),
    /// Smooth noise of this wavelength.
    Noise(f64),
    /// Balls on a grid of this pitch.
    Spots(f64),
    /// Only the first colour.
    Plain,
    /// As the ground below, for an object that is not turned and whose offset is its position.
    Ground,
}

/// Colour of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// How the colours share the space.
    pub pattern: Pattern,
    /// First colour, 0 to 1.
    pub first: DVec3,
    /// Second colour, 0 to 1.
    pub second: DVec3,
    /// Shift of the pattern, which also keeps its edges off the faces of a box.
    pub offset: DVec3,
    /// Seed of the noise.
    pub seed: u64,
}

impl Material {
    /// Albedo at a place in the object's frame.
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
                // Value noise keeps to the middle; spread it.
                ((t - 0.5) * 3.0 + 0.5).clamp(0.0, 1.0)
            }
            Pattern::Spots(pitch) => {
                let cell = p / pitch;
                f64::from((cell - cell.floor() - 0.5).length() < 0.42)
            }
        };
        // A slow change of brightness, so that no two patches are equal.
        let shade = 0.88 + 0.24 * noise(p / 0.45, self.seed + 2);
        self.first.lerp(self.second, share) * shade
    }
}

/// Albedo of the ground at a place of the world; the seed is the world's.
pub(super) fn ground_albedo(place: DVec3, seed: u64) -> DVec3 {
    let tile = (place / 0.55 + 0.21).floor();
    let odd = (tile.x + tile.y).rem_euclid(2.0);
    let base = DVec3::new(0.62, 0.58, 0.5).lerp(DVec3::new(0.46, 0.47, 0.45), odd);
    base * (0.75 + 0.5 * noise(place / 0.35, seed + 77))
}

/// Value noise in 0 to 1, one random value per unit cube's corner, smooth in between.
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

/// A colour from hue (0 to 1, wraps), saturation and value.
pub(super) fn hsv(hue: f64, saturation: f64, value: f64) -> DVec3 {
    let channel = |offset: f64| {
        let k = (offset + hue.rem_euclid(1.0) * 6.0) % 6.0;
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    DVec3::new(channel(5.0), channel(3.0), channel(1.0))
}
