//! Plain host data of a scene, options and errors; no Vulkan, no files.
//!
//! A [`Dataset`] has [`View`]s (a [`Camera`] with the [`Pixels`] of photo and mask) and [`Point`]s; [`Gaussians`] is
//! the model. A [`LabelMap`] has an object id per pixel, a [`DepthMap`] a depth. [`path`] orders cameras, a
//! [`keyframes::CameraPath`] passes smoothly through some, an [`Overview`] describes what they look at, and a [`Zone`]
//! is a box.

pub mod agreement;
pub mod camera;
pub mod colour;
pub mod depth;
pub mod direction;
pub mod error;
pub mod gaussians;
pub mod harmonics;
pub mod keyframes;
pub mod lab;
pub mod labels;
pub mod median;
pub mod options;
pub mod origin;
pub mod overview;
pub mod parallel;
pub mod path;
pub mod phases;
pub mod pixels;
pub mod principal;
pub mod sampling;
pub mod spread;
pub mod stage;
pub mod view;
pub mod words;
pub mod zone;

pub use camera::Camera;
pub use depth::{DepthKind, DepthMap};
pub use error::{Error, Result, Setting};
pub use gaussians::Gaussians;
pub use labels::{LABEL_MAX, LabelMap, MODEL_LABEL_MAX, Occluders, UNLABELLED, label_colour};
pub use overview::Overview;
pub use pixels::Pixels;
pub use view::stems;
pub use view::{ColourMatrix, Dataset, Photo, Point, SceneProblem, View};
pub use zone::Zone;
