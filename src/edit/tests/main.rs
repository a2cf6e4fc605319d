//! Tests of choosing and editing labels, on synthetic Gaussians.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod carry; // labels restored to a copy from another program
mod edits; // edits of an editor, one by one and from a file
mod fill; // the hole of a removed object is closed
mod labels; // labels by name, pixel and box; parts, fragments and colours of a model
mod selection; // Gaussians selected by hand
mod strokes; // objects cut by strokes
