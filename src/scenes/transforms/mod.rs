//! `transforms.json` in the styles of Blender, instant-ngp and nerfstudio.
//!
//! Poses are camera-to-world with OpenGL axes (y up, looking along -z) and become camera-from-world with OpenCV axes.
//! The world is the one of `transform_matrix`, which already includes nerfstudio's `applied_transform`.

mod file;
mod frame;
mod points;

use super::listed_path::SceneFolder;
use super::listing::{ListedPhoto, Listing};
use super::pose_convention::Native;
use super::split::SceneSplit;
use file::{Frame, Transforms};
use labelgs_scene::{Error, Result};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

pub(super) use frame::affine;

/// Reads the scene if it has transforms: `transforms_train.json` with `transforms_test.json` or, without that,
/// `transforms_val.json` held out; otherwise `transforms.json`; otherwise `transforms_train.json` alone.
pub fn list(scene: &SceneFolder) -> Result<Option<Listing>> {
    let file = |name: &str| Some(scene.root.join(name)).filter(|path| path.is_file());
    let (train, val, test) = (file("transforms_train.json"), file("transforms_val.json"), file("transforms_test.json"));
    let unused = val.clone().filter(|_| test.is_some());
    let files = match (train, test.or(val), file("transforms.json")) {
        (Some(train), Some(test), _) => vec![(train, Some(false)), (test, Some(true))],
        (_, _, Some(all)) => vec![(all, None)],
        (Some(train), None, None) => vec![(train, None)],
        _ => return Ok(None),
    };
    let mut listing = Listing::new(&files[0].0, Native::TRANSFORMS);
    if let (Some(val), 2) = (unused, files.len()) {
        listing.notes.push(format!("{} is ignored, because the test views are held out", val.display()));
    }
    for (path, test) in files {
        read(scene, &path, test, &mut listing)?;
    }
    strip_folder(&mut listing);
    Ok(Some(listing))
}

/// Returns the number of photos that a file lists; `None` if the file cannot be read.
pub fn count(path: &Path) -> Option<usize> {
    let transforms = file::read(path).ok()?;
    Some(transforms.frames.len() + transforms.test_frames.map_or(0, |frames| frames.len()))
}

pub fn list_file(scene: &SceneFolder, path: &Path) -> Result<Listing> {
    let mut listing = Listing::new(path, Native::TRANSFORMS);
    read(scene, path, None, &mut listing)?;
    strip_folder(&mut listing);
    Ok(listing)
}

fn read(scene: &SceneFolder, path: &Path, test: Option<bool>, listing: &mut Listing) -> Result<()> {
    let transforms = file::read(path)?;
    let first = listing.views.len();
    let frames = read_frames(scene, (path, &transforms), test, listing)?;
    file::note_unused(&transforms, &frames, &mut listing.notes);
    let points = points::read(scene, path, &transforms, &listing.views[first..], &mut listing.notes)?;
    listing.points.extend(points);
    let Transforms { train_filenames, val_filenames, test_filenames, .. } = transforms;
    let held_out: Vec<String> = val_filenames.into_iter().chain(test_filenames).flatten().collect();
    if train_filenames.is_some() || !held_out.is_empty() {
        let source = format!("the lists of file names in {}", path.display());
        SceneSplit { source, train: train_filenames, test: held_out }.apply(listing);
    }
    Ok(())
}

/// Adds the frames to the views of `listing`. An unusable frame only costs its photo, unless all are unusable.
fn read_frames(
    scene: &SceneFolder,
    (path, transforms): (&Path, &Transforms),
    test: Option<bool>,
    listing: &mut Listing,
) -> Result<Vec<Frame>> {
    let mut reader =
        FrameReader { scene, path, transforms, listing, seen: HashMap::new(), repeated: 0, refused: Vec::new() };
    let has_test = transforms.test_frames.is_some();
    let train = transforms.frames.iter().map(|value| (value, test.or(has_test.then_some(false))));
    let test = transforms.test_frames.iter().flatten().map(|value| (value, Some(true)));
    let mut frames = Vec::new();
    for (index, (value, test)) in train.chain(test).enumerate() {
        frames.extend(reader.read(index, value, test)?);
    }
    let FrameReader { repeated, mut refused, .. } = reader;
    let total = transforms.frames.len() + transforms.test_frames.as_ref().map_or(0, Vec::len);
    let is_of_frame = |error: &Error| matches!(error, Error::Data { path: of, .. } if of == path);
    if !refused.is_empty() && refused.len() == total && refused.iter().all(is_of_frame) {
        return Err(refused.swap_remove(0));
    }
    listing.bad.append(&mut refused);
    let bad = frames.iter().filter(|frame| frame.is_bad == Some(true)).count();
    let transposed = frames.iter().filter(|frame| frame::is_transposed(&frame.transform_matrix)).count();
    let counts = [
        (repeated, "that list a photo a second time are skipped"),
        (bad, "marked \"is_bad\" are omitted"),
        (transposed, "with the position in the last row of the matrix: transposed"),
    ];
    listing.note_counts(path, "frame", &counts);
    Ok(frames)
}

/// The frames of a file while they are being read.
struct FrameReader<'a> {
    scene: &'a SceneFolder<'a>,
    path: &'a Path,
    transforms: &'a Transforms,
    listing: &'a mut Listing,
    /// Photo of each name.
    seen: HashMap<String, Option<PathBuf>>,
    repeated: usize,
    /// Errors of unusable frames.
    refused: Vec<Error>,
}

impl FrameReader<'_> {
    /// Reads a frame; `None` if it is unusable.
    fn read(&mut self, index: usize, value: &Value, test: Option<bool>) -> Result<Option<Frame>> {
        let path = self.path;
        let name = value.get("file_path").and_then(Value::as_str).unwrap_or_default();
        let place = if name.is_empty() { format!("frame {index}") } else { format!("frame {index} (`{name}`)") };
        let frame: Frame = match file::part(path, &place, value) {
            Ok(frame) => frame,
            Err(error) => {
                self.refused.push(error);
                return Ok(None);
            }
        };
        if frame.is_bad == Some(true) {
            return Ok(Some(frame));
        }
        let resolved = self.scene.resolve(path, &frame.file_path)?;
        let photo = self.scene.photos.find(&[".", "images"], &resolved.path);
        let of = (&frame, &self.transforms.intrinsics);
        match frame::listed((path, &place), of, (resolved.name, photo)) {
            Ok(Some(view)) => self.add(&place, ListedPhoto { test, ..view })?,
            Ok(None) => self.listing.missing.push(frame.file_path.clone()),
            // A damaged photo or frame only costs that photo; a failing disk is an error.
            Err(error @ Error::Data { .. }) => self.refused.push(error),
            Err(error) => return Err(error),
        }
        Ok(Some(frame))
    }

    fn add(&mut self, place: &str, view: ListedPhoto) -> Result<()> {
        match self.seen.get(&view.name) {
            None => {
                self.seen.insert(view.name.clone(), view.photo.clone());
                self.listing.views.push(view);
            }
            Some(photo) if *photo == view.photo => self.repeated += 1,
            Some(_) => {
                let problem = format!("another photo is also called `{}`; rename one of them", view.name);
                return Err(Error::data(self.path, place, problem));
            }
        }
        Ok(())
    }
}

/// Removes a leading `images/` if all names have it, so that names match those of a COLMAP scene.
fn strip_folder(listing: &mut Listing) {
    let stripped = listing.views.iter().map(|view| view.name.strip_prefix("images/").map(str::to_owned));
    if let Some(names) = stripped.collect::<Option<Vec<String>>>() {
        listing.views.iter_mut().zip(names).for_each(|(view, name)| view.name = name);
    }
}
