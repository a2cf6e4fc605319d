//! What pages in a browser share: the camera with its mouse and keys.

/// Vectors and rotations, a module of JavaScript.
pub(crate) const ALGEBRA: &str = include_str!("algebra.js");
/// The camera, a module that imports [`ALGEBRA`].
pub(crate) const CAMERA: &str = include_str!("camera.js");
/// Mouse, touch and keys that move the camera, a module.
pub(crate) const INPUT: &str = include_str!("input.js");
