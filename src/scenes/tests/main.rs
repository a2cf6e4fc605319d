//! Scene readers, on files that the tests write.
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
mod objects; // photos of objects alone
mod photos; // decoding, sizes, averaging, undistortion
mod poses; // LLFF and Metashape
mod rigs;
mod splits; // held-out views that a data set names
mod transforms; // transforms.json and its dialects

use labelgs_scene::{Dataset, Result, View};
use labelgs_scenes::LoadOptions;

/// Options without held-out views.
fn all() -> LoadOptions {
    LoadOptions { test_every: None, ..LoadOptions::default() }
}

/// Opens a scene without held-out views.
fn open(scene: &fixtures::Scene) -> Result<Dataset> {
    labelgs_scenes::open(scene.path(), &all())
}

fn names(views: &[View]) -> Vec<&str> {
    views.iter().map(|view| view.name.as_str()).collect()
}

/// Requires a note that contains all `parts`.
#[track_caller]
fn noted(notes: &[String], parts: &[&str]) {
    let has = |note: &String| parts.iter().all(|part| note.contains(part));
    assert!(notes.iter().any(has), "{parts:?}: {notes:?}");
}
