//! Mask folders are imported and checked.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod annotation_tools; // files of segmenters and annotation tools
mod check; // each planted fault is found, clean masks have none
#[path = "../../scenes/tests/fixtures.rs"]
#[allow(dead_code, reason = "most of it is for scenes")]
mod fixtures;
mod forms; // writers of every form, from one truth
mod import; // every form is imported exactly, ambiguous ones are refused
