//! Readers and writers of all file formats, on files that the tests write.

mod axes;
mod checkpoint;
mod colmap;
mod depths;
mod finding;
pub mod fixtures;
mod foreign;
mod formats;
mod frames;
mod init;
mod label_table;
mod mask_check;
mod mask_forms;
mod mask_import;
mod mask_tools;
mod masks;
mod model;
mod output;
mod photos;
mod pipeline_file;
mod ply;
mod poses;
mod splits;
mod transforms;
