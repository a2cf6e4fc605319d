//! Output of projection, and the gradients that blending returns.

/// A Gaussian as seen in one view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Splat {
    /// Row of the model.
    pub gaussian: usize,
    /// Camera-space z, world units.
    pub depth: f64,
    /// Centre, px.
    pub mean2d: [f64; 2],
    /// (A, B, C) of the inverse covariance [[A, B], [B, C]], px^-2.
    pub conic: [f64; 3],
    /// Opacity after the sigmoid.
    pub opacity: f64,
    /// Colour after the clamp.
    pub colour: [f64; 3],
}

/// Gradients of a splat's fields. `conic[1]` is the derivative with respect to B, which occurs twice in the matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SplatGradient {
    /// With respect to the centre, px^-1.
    pub mean2d: [f64; 2],
    /// With respect to (A, B, C).
    pub conic: [f64; 3],
    /// With respect to the opacity after the sigmoid.
    pub opacity: f64,
    /// With respect to the colour.
    pub colour: [f64; 3],
}

impl SplatGradient {
    /// The sum of two gradients.
    pub fn plus(&self, other: &Self) -> Self {
        let add = |a: f64, b: f64| a + b;
        Self {
            mean2d: [0, 1].map(|i| add(self.mean2d[i], other.mean2d[i])),
            conic: [0, 1, 2].map(|i| add(self.conic[i], other.conic[i])),
            opacity: add(self.opacity, other.opacity),
            colour: [0, 1, 2].map(|i| add(self.colour[i], other.colour[i])),
        }
    }
}
