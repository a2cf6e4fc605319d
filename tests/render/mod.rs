//! Pictures of a model.

mod formats; // every format shows the same picture
mod picture_files; // files of rendered pictures
