//! labelgs: label-aware 3D Gaussian Splatting on Vulkan compute.
//!
//! # Floors
//!
//! A module uses lower ones only (`tests/architecture.rs` reads the `use` lines):
//!
//! ```text
//! internals              what the program, tests and benchmarks reach into
//! cli                    verbs: what is typed, what is decided
//! verify                 the method in f64, and the device compared with it, for tests and users
//! run                    a training from a folder of photos to a folder with a model; its observer
//! train                  the loop over steps, and what happens between them
//! eval     synth         scores of a model; a scene with every truth
//! label                  labels from masks, occluders, repair of masks
//! render   edit          pictures of a model; its labels chosen and changed, without a device
//! engine                 a device with a model in its memory
//! pass                   what the engine does, as lists of GPU passes; no Vulkan
//! scheduler  io          plans lists (sizes, places, barriers) and executes them; files
//! shaders  gpu   scene   generated interfaces; a thin layer over Vulkan; plain host data
//! options                options that are written once: flag, key, help, default, range
//! error    lab
//! ```
//!
//! # Words
//!
//! *Gaussian*: a row of the model. *Splat*: its projection in a view. *Instance*: a (splat, tile) pair, numbered
//! as before the sort. *Layer*: the scene (0) or one sampled object of the view. *Label*: an object's id, 0 for none.
//! *Mask*: the visible ids of a photo. *Step*: one update of the parameters. *View*: a posed photo. A gradient is named
//! `v_` and the value's name, first and second moments `m_` and `u_`.
//!
//! The paper's names: B_j is `labels[j]`, M_k a mask, U_k what [`label::occlusion`] finds, H(G, k) an object layer, GPF the
//! test of the projected centre in `glsl/include/label_rules.glsl`.
//!
//! # Conventions
//!
//! World units are the data set's. Camera axes are OpenCV's (x right, y down, z forward); pixel (0, 0) has its centre at
//! (0.5, 0.5). Quaternions are (w, x, y, z). Opacity and scale are stored before their sigmoid and exponential.
//!
//! # Life of a step
//!
//! [`train::Trainer::step`] draws a view, writes its photo, masks and uniforms into one of two frames in flight and
//! submits the list that [`pass::training_step`] declared: cull, sort by depth, project, list (splat, tile) pairs, sort them by layer and
//! tile, blend forward, loss, blend backward, gather, project backward, Adam. Nothing is read back inside a step; its
//! report is read when the frame comes round again. A buffer that was too small sets a sticky bit, every later pass leaves
//! the model alone, the buffer grows, and the steps run again.
#![deny(unsafe_code)]
#![warn(unreachable_pub)]
#![deny(clippy::print_stdout, clippy::print_stderr, clippy::dbg_macro)]
#![cfg_attr(
    not(feature = "cli"),
    allow(dead_code, unused_imports, reason = "what only the commands use is left out by the linker")
)]

#[cfg(feature = "cli")]
mod cli;
pub mod edit;
pub mod engine;
mod error;
pub mod eval;
pub mod gpu;
#[doc(hidden)]
pub mod internals;
pub mod io;
mod lab;
pub mod label;
mod options;
mod pass;
pub mod render;
pub mod run;
pub mod scene;
mod scheduler;
mod shaders;
pub mod synth;
mod train;
mod verify;

pub use error::{Error, Result};
