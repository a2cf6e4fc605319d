//! Label-aware 3D Gaussian Splatting on Vulkan compute.
//!
//! From posed photos and object masks, labelgs trains a scene of 3D Gaussians in which every Gaussian carries the id of
//! its object, so that objects can be listed, extracted, removed, rendered and scored. It follows *LabelGS* (arXiv
//! 2508.19699) on *3D Gaussian Splatting* (Kerbl et al. 2023), and runs on any Vulkan 1.2 device: a GPU, or the CPU
//! through Mesa's lavapipe. It needs no CUDA, no Python and no network.
//!
//! Make a synthetic scene, train it, extract one object, and render the rest:
//!
//! ```no_run
//! use labelgs::engine::Engine;
//! use labelgs::gpu::{Gpu, GpuOptions};
//! use labelgs::{edit, formats, render, run, scenes, synth};
//! use std::path::Path;
//!
//! fn main() -> labelgs::Result<()> {
//!     let scene = Path::new("scene");
//!     synth::write(&synth::SynthOptions::default(), scene, &|_| Ok(()))?;
//!
//!     let mut request = run::Request::new(scene, "out");
//!     request.inputs.masks = Some(scene.join("masks"));
//!     let summary = run::train(&request, &|| Gpu::new(&GpuOptions::default()), &mut ())?;
//!
//!     let model = formats::read_model(&summary.model)?.gaussians;
//!     let barrel = edit::extract(&model, &[3], edit::MIN_LABEL_CONFIDENCE)?;
//!     let rest = edit::remove(&model, &[3])?;
//!     formats::write_model("barrel.ply", &barrel)?;
//!
//!     let camera = scenes::open(scene, &scenes::LoadOptions::default())?.test[0].camera.clone();
//!     let size = (camera.width, camera.height);
//!     let mut engine = Engine::for_model(Gpu::new(&GpuOptions::default())?, &rest, [size])?;
//!     let picture = render::render(&mut engine, &camera, &render::RenderOptions::default())?;
//!     render::write_rgb(Path::new("rest.png"), size, &picture.rgb, render::Format::Png)
//! }
//! ```
//!
//! | to | start at |
//! | --- | --- |
//! | train, watch, pause, resume | [`run::train`], [`run::Observer`] |
//! | change the training itself | [`train`] |
//! | read scenes, masks, models; write models | [`scenes::open`], [`masks`], [`formats`] |
//! | draw pictures, depth, label maps | [`engine::Engine::for_model`], [`render::render`] |
//! | choose, extract, change objects | [`edit`] |
//! | label a finished model, repair masks | [`label`] |
//! | train a scene that fits no GPU | [`blocks`] |
//! | score | [`eval`] |
//! | read the manual | [`guide`] |
//!
//! # Conventions
//!
//! World units are the data set's. Camera axes are OpenCV's (x right, y down, z forward); pixel (0, 0) has its centre
//! at (0.5, 0.5). Quaternions are (w, x, y, z). Opacity and scale are stored before their sigmoid and exponential.
//! Labels are ids from 1 to 65535, in models to 2^31 - 1; 0 is no label. Functions return [`Result`] with one [`Error`]
//! type and print nothing; progress and warnings go to `tracing`.
//!
//! # Features
//!
//! `cli` (default): the program, with clap, progress bars and signals; without it the library needs none of them.
//! `viewer`, a part of `cli`: shows a model or a run in a browser. `network`, a part of `cli`: makes masks with a
//! segmentation network. `build-shaderc` (default): builds the shader compiler from source instead of linking the
//! system's. `lab`: fault injection, for tests.
#![deny(unsafe_code)]
#![warn(unreachable_pub)]
#![deny(clippy::print_stdout, clippy::print_stderr, clippy::dbg_macro)]

pub mod blocks;
mod bundle_adjustment;
#[cfg(feature = "cli")]
pub mod cli;
pub mod engine;
pub mod eval;
pub mod gpu;
pub mod guide;
pub mod label;
pub mod pass;
pub mod records;
pub mod render;
pub mod run;
pub mod scheduler;
pub mod shaders;
pub mod train;
pub mod verify;
mod version;
#[cfg(feature = "viewer")]
pub mod viewer;

pub use labelgs_edit as edit;
pub use labelgs_files as files;
pub use labelgs_formats as formats;
pub use labelgs_masks as masks;
pub use labelgs_reference as reference;
pub use labelgs_scene::{self as scene, Error, Result, Setting};
pub use labelgs_scenes as scenes;
#[cfg(feature = "network")]
pub use labelgs_segment as segment;
pub use labelgs_synth as synth;

use labelgs_report as report;
use labelgs_scene::{error, lab, options, phases, stage, words};
#[cfg(feature = "viewer")]
use labelgs_web as web;

/// Compiles the programs in README.md.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
