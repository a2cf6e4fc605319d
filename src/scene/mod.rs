//! Plain host data of a scene: cameras, Gaussians, labels, views. No Vulkan, no files.

pub mod camera;
pub mod depth;
pub mod gaussians;
pub mod labels;
pub mod origin;
pub mod path;
pub mod view;

pub use camera::Camera;
pub use depth::{DepthKind, DepthMap};
pub use gaussians::Gaussians;
pub use labels::{LabelMap, Occluders, UNLABELLED};
pub use view::{Dataset, Photo, Point, View, stems};
