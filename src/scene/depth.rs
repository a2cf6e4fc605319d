//! Depth maps.

/// The meaning of the values in a depth map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum DepthKind {
    /// Inverse depth with unknown scale and offset, as from monocular networks: larger is nearer.
    Inverse,
    /// z or distance: larger is farther, 0 is a hole.
    Metric,
}

/// The depth map of a view, row-major. Values that are not finite are holes.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Depths, `[height, width]`.
    pub values: Vec<f32>,
}
