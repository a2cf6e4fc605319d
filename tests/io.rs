//! Readers and writers of all file formats, on files that the tests write.

mod axes;
mod checkpoint;
#[path = "../src/scenes/tests/fixtures.rs"]
#[allow(dead_code, reason = "tests of readers use the rest")]
pub mod fixtures;
mod formats;
mod init;
mod mask_check;
mod mask_forms;
mod mask_import;
mod mask_tools;
mod output;
mod pipeline_file;
mod ply;
