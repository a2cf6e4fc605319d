//! Plain host data of a scene: cameras, Gaussians, labels, views. No Vulkan, no files.

pub(crate) mod camera;
pub(crate) mod depth;
pub(crate) mod gaussians;
pub(crate) mod labels;
pub(crate) mod origin;
pub mod path;
pub(crate) mod view;

pub use camera::Camera;
pub use depth::{DepthKind, DepthMap};
pub use gaussians::Gaussians;
pub use labels::{LABEL_MAX, LabelMap, Occluders, UNLABELLED, label_colour};
pub(crate) use view::stems;
pub use view::{Dataset, Photo, Point, View};
