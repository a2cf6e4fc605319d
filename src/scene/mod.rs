//! Plain host data of a scene; no Vulkan, no files.
//!
//! A [`Dataset`] has [`View`]s (a [`Camera`] with [`Pixels`] of photo and mask) and [`Point`]s; [`Gaussians`] is the model. A
//! [`LabelMap`] has an object id per pixel, a [`DepthMap`] a depth. [`path`] makes smooth paths through cameras, an [`Overview`] is what they look at.
//! A [`Zone`] is a box.

pub(crate) mod agreement;
pub(crate) mod camera;
pub(crate) mod colour;
pub(crate) mod crew;
pub(crate) mod depth;
pub(crate) mod direction;
pub(crate) mod gaussians;
pub mod harmonics;
pub(crate) mod labels;
pub(crate) mod median;
pub(crate) mod origin;
pub(crate) mod overview;
pub mod path;
pub(crate) mod pixels;
pub(crate) mod sampling;
pub(crate) mod spread;
pub(crate) mod view;
pub(crate) mod zone;

pub use camera::Camera;
pub use depth::{DepthKind, DepthMap};
pub use gaussians::Gaussians;
pub use labels::{LABEL_MAX, LabelMap, MODEL_LABEL_MAX, Occluders, UNLABELLED, label_colour};
pub use overview::Overview;
pub use pixels::Pixels;
pub(crate) use view::stems;
pub use view::{ColourMatrix, Dataset, Flaw, Photo, Point, View};
pub use zone::Zone;
