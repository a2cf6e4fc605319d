//! Pictures of a model.

mod formats; // every format shows the same picture
mod mesh; // closed surfaces against true shapes
mod picture_files; // files of rendered pictures
