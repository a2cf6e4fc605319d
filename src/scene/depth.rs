//! A depth per pixel.

/// How numbers of a depth map are to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum DepthKind {
    /// Larger is nearer, up to an unknown scale and offset, as networks for single photos predict it.
    Inverse,
    /// z or distance: larger is farther; 0 is no depth.
    Metric,
}

/// Depths of a view, row-major; what is not finite is a hole.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Depths, [height, width].
    pub values: Vec<f32>,
}
