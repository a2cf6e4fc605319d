//! Files to scenes and back, on fixtures that the tests write themselves.

mod checkpoint;
mod colmap;
mod depths;
pub mod fixtures;
mod init;
mod label_table;
mod mask_check;
mod mask_forms;
mod mask_import;
mod masks;
mod model;
mod output;
mod photos;
mod pipeline_file;
mod ply;
mod transforms;
