//! Models of typical values, and all writable formats with their error bounds.

use labelgs_formats::{SpzVersion, WriteOptions};
use labelgs_scene::Gaussians;

/// Largest change of each value in a round trip.
#[derive(Clone, Copy)]
pub struct Bounds {
    pub position: f32,
    /// Of a component of the unit rotation.
    pub rotation: f32,
    pub scale: f32,
    /// Of the opacity after the sigmoid.
    pub opacity: f32,
    pub colour: f32,
    /// Of coefficients of degree 1, and of higher ones.
    pub harmonics: [f32; 2],
    pub confidence: f32,
}

/// Half of a quantisation step. Positions have 12 fractional bits. Each of the three smaller rotation components is off
/// by up to 1 / (2 * 511 * sqrt 2) = 0.0007. The largest one follows from the unit length and is off by up to three
/// times that if all are alike. Harmonics are rounded twice: to 1/128, then to 8 or 16 of these steps.
pub const SPZ: Bounds = Bounds {
    position: 1.01 / 8192.0,
    rotation: 0.0022,
    scale: 1.01 / 32.0,
    opacity: 1.01 / 510.0,
    colour: 1.01 / 76.5,
    harmonics: [4.51 / 128.0, 8.51 / 128.0],
    confidence: 1.01 / 510.0,
};

/// Floats throughout, also in USD. Rotations lose their length. Sizes and opacities go through an exponential and back,
/// each rounded to 24 bits.
pub const GLB: Bounds = Bounds {
    position: 0.0,
    rotation: 1e-6,
    scale: 1e-5,
    opacity: 1e-6,
    colour: 0.0,
    harmonics: [0.0; 2],
    confidence: 0.0,
};

/// Positions are the exponential of one of 65536 steps up to ln 9. Rotations have 8 bits over sqrt 2. Sizes and colours
/// are near one of 256 numbers, at most two of their mean distances away. The palette of harmonics has fewer entries
/// than Gaussians, so a single one has no bound; the render has.
pub const SOG: Bounds = Bounds {
    position: 9.0 * 2.0 * 2.198 / 131_070.0 * 1.01,
    rotation: 3.05 * std::f32::consts::SQRT_2 / 510.0,
    scale: 2.0 * 10.0 / 256.0,
    opacity: 1.01 / 510.0,
    colour: 2.0 * 3.0 / 256.0,
    harmonics: [f32::INFINITY; 2],
    confidence: 1.01 / 510.0,
};

/// A reproducible sequence of numbers from `low` to `high`.
pub struct Numbers(u64);

impl Numbers {
    pub fn from(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 40) as f32 / (1_u64 << 24) as f32)
    }

    pub fn triple(&mut self, low: f32, high: f32) -> [f32; 3] {
        [0; 3].map(|_| self.from(low, high))
    }
}

/// A model of typical values; rotations have any length and sign.
pub fn model(count: usize, degree: u32, labelled: bool) -> Gaussians {
    let mut n = Numbers(7);
    let mut g = Gaussians { sh_degree: degree, ..Gaussians::default() };
    for _ in 0..count {
        g.means.push(n.triple(-8.0, 8.0));
        g.quats.push([0; 4].map(|_| n.from(-2.0, 2.0)));
        g.scales.push(n.triple(-9.0, 1.0));
        g.opacities.push(n.from(-4.0, 4.0));
        g.sh0.push(n.triple(-1.5, 1.5));
        g.sh_rest.extend((0..g.rest_per_gaussian()).map(|_| n.triple(-0.9, 0.9)));
    }
    g.labels = labelled.then(|| (0..count as u32).map(|row| [0, 3, 3, 700][row as usize % 4]).collect());
    g.label_confidence = labelled.then(|| (0..count).map(|_| n.from(0.0, 1.0)).collect());
    g
}

pub fn v4() -> WriteOptions {
    WriteOptions { spz_version: SpzVersion::V4, ..WriteOptions::default() }
}

/// All writable formats: file, options, bounds.
pub fn written() -> [(&'static str, WriteOptions, Bounds); 7] {
    let usual = WriteOptions::default();
    [
        ("a.spz", usual, SPZ),
        ("b.spz", v4(), SPZ),
        ("a.glb", usual, GLB),
        ("a.sog", usual, SOG),
        ("a.html", usual, SPZ),
        ("a.usda", usual, GLB),
        ("a.usdz", usual, GLB),
    ]
}

/// Long and thin Gaussians in a ball, in all directions, with view-dependent colours.
pub fn picture_model() -> Gaussians {
    let mut n = Numbers(3);
    let mut g = model(1500, 3, true);
    g.means.iter_mut().for_each(|mean| *mean = mean.map(|value| value / 8.0));
    g.scales.iter_mut().for_each(|scale| *scale = [n.from(-2.5, -1.8), n.from(-5.0, -4.0), n.from(-4.0, -3.0)]);
    g.sh_rest.iter_mut().for_each(|triple| *triple = triple.map(|value| 0.25 * value));
    g
}
