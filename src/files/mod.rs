//! Access to files: bounded reads, atomic writes, images, names, and the table of labels.
//!
//! All reads go through [`read`] and all writes through [`atomic`] or [`append`], so that injected faults reach each of them
//! and no crash leaves a partial file.

pub(crate) mod all;
pub(crate) mod append;
pub(crate) mod atomic;
pub(crate) mod depth_file;
pub(crate) mod image;
pub(crate) mod kind;
pub(crate) mod label_table;
pub(crate) mod names;
pub(crate) mod npy;
pub(crate) mod read;
pub(crate) mod resize;
pub(crate) mod run_folder;
pub(crate) mod scratch;

pub use image::read_photo;
pub use label_table::{LabelEntry, LabelTable};
