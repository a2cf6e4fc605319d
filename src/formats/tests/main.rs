//! Model files, including those of other programs.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod extensions; // formats by extension and by first bytes
#[path = "../../scenes/tests/fixtures.rs"]
#[allow(dead_code, reason = "most of it is for scenes")]
mod fixtures;
mod foreign; // files of other programs
#[allow(dead_code, reason = "pictures are drawn where a device is")]
mod models;
mod ply; // the columns of a PLY, whole and damaged
mod round_trips; // what a format may change, and how bad files are refused
mod usd; // prims of other programs, and damaged layers
