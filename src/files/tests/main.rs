//! Files: complete or absent writes, images, the label table.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

#[path = "../../scenes/tests/fixtures.rs"]
#[allow(dead_code, reason = "most of it is for scenes")]
mod fixtures;
mod label_table; // round trips, and invalid tables refused
mod videos;
mod writes; // atomic writes, their litter, pictures // frames that go to an encoder
