//! Access to files: bounded reads, atomic writes, images, names, and the table of labels.
//!
//! All reads go through [`read`] and all writes through [`atomic`] or [`append`], so that tests can inject faults into
//! each of them and no crash leaves a partial file.

pub mod append;
pub mod atomic;
pub mod content;
pub mod depth_file;
pub mod error_list;
pub mod image;
pub mod label_table;
pub mod names;
pub mod npy;
pub mod photo_files;
pub mod program;
pub mod read;
pub mod resize;
pub mod run_folder;
pub mod scratch;
pub mod video;

pub use image::read_photo;
pub use label_table::{LabelEntry, LabelTable};
