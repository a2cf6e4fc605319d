//! Labels chosen and edited, on Gaussians made by hand.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod carry; // labels given back to a copy from another program
mod edits; // changes of an editor, one by one and from a file
mod fill; // the place of a removed object is closed
mod labels; // labels by name, pixel and box; parts, specks and colours of a model
mod selection; // Gaussians chosen by hand
mod strokes; // objects cut by strokes
