//! Readers of scenes, on files that the tests write.
#![allow(
    clippy::disallowed_methods,
    clippy::too_many_lines,
    reason = "the rules of files and lengths are those of the library"
)]

mod cameras; // one camera from a file, all of them to one
mod colmap; // models in any form, whole and damaged
mod depths; // depth maps from every kind of file, brought to their photos
mod finding; // photos at other places than listed
#[allow(dead_code, reason = "tests of other crates use it too")]
mod fixtures;
mod frames; // conventions of poses, points of another frame
mod init; // the first Gaussians of a scene
mod lenses; // formulas of lenses, and a scene through each of them
mod masks; // masks beside their photos
mod photos; // decoding, sizes, averaging, undistortion
mod poses; // LLFF and Metashape
mod rigs;
mod splits; // held-out views that a data set names
mod transforms; // transforms.json and its dialects
