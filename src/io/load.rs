//! Loads a data set from a listing: split, decode, undistort, resize, masks.

use super::LoadOptions;
use super::bad_photos::{self, LISTED_MAX};
use super::image::{check_size, photo_size, read_photo};
use super::lens::Lens;
use super::listing::{Listed, Listing, check_camera};
use super::mask::{MaskFolder, read_checked};
use super::resample::{bounded_size, resample_ids, same_aspect, shrink_photo, undistort_photo};
use super::window::Window;
use crate::error::{Error, Result};
use crate::scene::{Camera, Dataset, LabelMap, Photo, View};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

pub(crate) fn load(root: &Path, mut listing: Listing, options: &LoadOptions) -> Result<Dataset> {
    let mut notes = std::mem::take(&mut listing.notes);
    let mut views = existing(&listing, options, &mut notes)?;
    views.sort_by(|a, b| a.name.cmp(&b.name));
    let test = split(&views, options.test_every, &mut notes)?;
    let masks = options.masks.as_deref().map(|folder| MaskFolder::new(folder, views.iter().map(|v| v.name.as_str())));
    let masks = masks.transpose()?;
    let ignore = options.ignore.as_deref().map(|folder| MaskFolder::new(folder, views.iter().map(|v| v.name.as_str())));
    let ignore = ignore.transpose()?;
    if let Some(ignore) = ignore.as_ref().filter(|ignore| views.iter().all(|view| ignore.find(&view.name).is_none())) {
        return Err(ignore.nothing_found(&views[0].name));
    }
    let resampled = AtomicUsize::new(0);
    let folders = (masks.as_ref(), ignore.as_ref());
    let read = |view| Ok(load_views(view, decode(view, options)?, options, folders, &resampled));
    let read: Vec<Result<Result<Vec<View>>>> = views.par_iter().map(read).collect();
    let mut undecodable = std::mem::take(&mut listing.bad);
    let total = views.len() + undecodable.len();
    let mut loaded = Vec::with_capacity(views.len());
    for (view, test) in read.into_iter().zip(test) {
        match view {
            Ok(views) => loaded.push(views.map(|views| (views, test))),
            Err(error) => undecodable.push(error),
        }
    }
    bad_photos::skip(root, undecodable, total, options, &mut notes)?;
    let loaded: Vec<(Vec<View>, bool)> = all_or_one_error(root, loaded)?;
    if let Some(masks) = &masks {
        let without = views.iter().filter(|view| masks.find(&view.name).is_none()).map(|view| view.name.as_str());
        let without: Vec<&str> = without.collect();
        if without.len() == views.len() {
            return Err(masks.nothing_found(&views[0].name));
        }
        if !without.is_empty() {
            notes.push(format!("{} of {} photos have no mask: {}", without.len(), views.len(), shortened(&without)));
        }
    }
    if resampled.load(Relaxed) > 0 {
        let count = resampled.load(Relaxed);
        notes.push(format!("{count} masks differ in size from their photos and were scaled (nearest id)"));
    }
    if options.undistort && views.iter().any(|view| !view.lens.is_pinhole()) {
        notes.push("photos and masks were undistorted to a pinhole camera; pixels without a source are ignored".into());
    }
    let wide: Vec<&Vec<View>> = loaded.iter().map(|(views, _)| views).filter(|views| views.len() > 1).collect();
    if !wide.is_empty() {
        let faces: usize = wide.iter().map(|views| views.len()).sum();
        notes.push(format!("{} photos are wider than a pinhole picture and became {faces} faces of cubes", wide.len()));
    }
    let mut dataset = Dataset { root: root.to_owned(), points: listing.points, notes, ..Dataset::default() };
    for (views, test) in loaded {
        if test { dataset.test.extend(views) } else { dataset.train.extend(views) }
    }
    // Faces of a photo are not in the order of their names.
    dataset.train.sort_by(|a, b| a.name.cmp(&b.name));
    dataset.test.sort_by(|a, b| a.name.cmp(&b.name));
    require_unique(root, &dataset)?;
    Ok(dataset)
}

/// Refuses a photo that is named as the face of another.
fn require_unique(root: &Path, dataset: &Dataset) -> Result<()> {
    let all = dataset.all();
    match all.windows(2).find(|pair| pair[0].name == pair[1].name) {
        Some(pair) => {
            let problem = "is the name of a photo and of a face of a wide photo; rename the photo";
            Err(Error::data(root, format!("view {}", pair[0].name), problem))
        }
        None => Ok(()),
    }
}

pub(crate) fn shortened(names: &[&str]) -> String {
    let shown = names.iter().take(3).copied().collect::<Vec<_>>().join(", ");
    if names.len() > 3 { format!("{shown}, ...") } else { shown }
}

/// Returns the views whose photos exist; if photos are not requested and none exists, all views with a known size.
fn existing(listing: &Listing, options: &LoadOptions, notes: &mut Vec<String>) -> Result<Vec<Listed>> {
    let total = listing.views.len() + listing.missing.len();
    if total + listing.bad.len() == 0 {
        return Err(Error::data(&listing.source, "", "lists no photo"));
    }
    let found = listing.views.iter().filter(|view| view.photo.is_some()).count();
    if found == 0 && !options.photos && !listing.views.is_empty() {
        notes.push("no listed photo exists; cameras have the sizes that the data set states".into());
        return Ok(listing.views.clone());
    }
    let absent = listing.views.iter().filter(|view| view.photo.is_none()).map(|view| view.name.as_str());
    let absent: Vec<&str> = absent.chain(listing.missing.iter().map(String::as_str)).collect();
    if absent.len() * 2 > total {
        let problem = format!(
            "{} of {total} listed photos do not exist (such as {}); expected in `images` or at the listed path below \
             the scene",
            absent.len(),
            shortened(&absent)
        );
        return Err(Error::data(&listing.source, "photos", problem));
    }
    if !absent.is_empty() {
        let (count, names) = (absent.len(), shortened(&absent));
        notes.push(format!("{count} of {total} listed photos do not exist and are skipped: {names}"));
    }
    Ok(listing.views.iter().filter(|view| view.photo.is_some()).cloned().collect())
}

/// Returns which of the views, sorted by name, are held out.
fn split(views: &[Listed], every: Option<u32>, notes: &mut Vec<String>) -> Result<Vec<bool>> {
    if views.iter().all(|view| view.test.is_some()) {
        return Ok(views.iter().map(|view| view.test == Some(true)).collect());
    }
    let Some(every) = every else { return Ok(vec![false; views.len()]) };
    if every == 0 {
        return Err(Error::usage("test_every", "0 holds out nothing and everything; expected 1 or more"));
    }
    if views.len() == 1 && every > 1 {
        notes.push("the only photo is used for training; nothing is held out".into());
        return Ok(vec![false]);
    }
    Ok((0..views.len()).map(|index| index % every as usize == 0).collect())
}

/// Returns the loaded views, or one error that lists all failures.
pub(crate) fn all_or_one_error<T>(root: &Path, loaded: Vec<Result<T>>) -> Result<Vec<T>> {
    let total = loaded.len();
    let mut views = Vec::with_capacity(total);
    let mut errors = Vec::new();
    for view in loaded {
        match view {
            Ok(view) => views.push(view),
            Err(error) => errors.push(error),
        }
    }
    match errors.len() {
        0 => Ok(views),
        1 => Err(errors.remove(0)),
        count => {
            let shown: Vec<String> = errors.iter().take(LISTED_MAX).map(ToString::to_string).collect();
            let more = if count > LISTED_MAX { format!("\n  and {} more", count - LISTED_MAX) } else { String::new() };
            let problem = format!("{count} of {total} views cannot be used:\n  {}{more}", shown.join("\n  "));
            Err(Error::data(root, "", problem))
        }
    }
}

/// The size in a photo's file, and its pixels if they are wanted.
type Decoded = (Option<(u32, u32)>, Option<Photo>);

fn decode(listed: &Listed, options: &LoadOptions) -> Result<Decoded> {
    let Some(path) = &listed.photo else { return Ok((None, None)) };
    if !options.photos {
        return Ok((Some(stored_size(path)?), None));
    }
    // Check the shape before the pixels take memory; the error comes later.
    let size = stored_size(path)?;
    let fits = same_aspect(size, (listed.camera.width, listed.camera.height));
    let photo = if fits { Some(read_photo(path, options.background)?) } else { None };
    Ok((Some(size), photo))
}

/// Makes the views of a photo, one or several.
fn load_views(
    listed: &Listed,
    (stored, mut photo): Decoded,
    options: &LoadOptions,
    (masks, ignore): (Option<&MaskFolder>, Option<&MaskFolder>),
    resampled: &AtomicUsize,
) -> Result<Vec<View>> {
    let original = at_size(listed, stored)?;
    let mask = match masks.and_then(|masks| masks.find(&listed.name)) {
        Some(path) => Some(load_mask(&path, (original.width, original.height), resampled)?),
        None => None,
    };
    if let (Some(path), Some(photo)) = (ignore.and_then(|ignore| ignore.find(&listed.name)), &mut photo) {
        leave_out(photo, &load_mask(&path, (original.width, original.height), resampled)?);
    }
    let windows = match options.undistort {
        true => Window::all(&listed.name, &original, &listed.lens),
        false => vec![Window::stored(&listed.name, &original)],
    };
    let photo_path = listed.photo.as_deref().unwrap_or(Path::new(&listed.name));
    if windows.is_empty() {
        return Err(Error::data(photo_path, "", NO_WINDOW));
    }
    // A lens of odd coefficients may have no scale at its axis.
    for window in windows.iter().filter(|window| !window.is_photo()) {
        check_camera(photo_path, &format!("view {}", window.name), &window.camera, &Lens::Pinhole)?;
    }
    let view = |window: Window| {
        let size = bounded_size((window.camera.width, window.camera.height), options.max_resolution);
        View {
            camera: window.camera.resized(size.0, size.1),
            photo: photo.as_ref().map(|photo| Arc::new(fitted(photo, &window, size))),
            mask: mask.as_ref().map(|mask| Arc::new(resample_ids(mask, &window, size))),
            name: window.name,
        }
    };
    Ok(windows.into_iter().map(view).collect())
}

/// Takes the weight of the pixels where `ignored`, of any scale, is not 0.
fn leave_out(photo: &mut Photo, ignored: &LabelMap) {
    let nearest = |at: u32, side: u32, from: u32| {
        (((f64::from(at) + 0.5) * f64::from(from) / f64::from(side)) as u32).min(from - 1)
    };
    let (width, height) = (photo.width, photo.height);
    for (at, texel) in (0..).zip(&mut photo.rgba) {
        let (x, y) = (at % width, at / width);
        if ignored.at(nearest(x, width, ignored.width), nearest(y, height, ignored.height)) != 0 {
            *texel = [0; 4];
        }
    }
}

const NO_WINDOW: &str = "the lens of its camera shows nothing of the photo; check focal lengths and coefficients";

/// Returns the camera at the size of the photo's file, which may be a scaled version of the size in the data set.
pub(crate) fn at_photo_size(listed: &Listed) -> Result<Camera> {
    at_size(listed, listed.photo.as_deref().map(stored_size).transpose()?)
}

fn stored_size(path: &Path) -> Result<(u32, u32)> {
    let size = photo_size(path)?;
    check_size(path, size)?;
    Ok(size)
}

fn at_size(listed: &Listed, stored: Option<(u32, u32)>) -> Result<Camera> {
    let (Some(path), Some(size)) = (&listed.photo, stored) else { return Ok(listed.camera.clone()) };
    let camera = &listed.camera;
    if !same_aspect(size, (camera.width, camera.height)) {
        let problem = format!(
            "the photo has {} x {} px and its camera {} x {} px, which no scale explains; use the photos that the \
             cameras were made for (an EXIF orientation is ignored, because poses belong to the stored pixels)",
            size.0, size.1, camera.width, camera.height
        );
        return Err(Error::data(path, "", problem));
    }
    Ok(camera.resized(size.0, size.1))
}

/// Undistorts the photo and scales it to the final size.
fn fitted(photo: &Photo, window: &Window, (width, height): (u32, u32)) -> Photo {
    if window.is_photo() {
        return shrink_photo(photo, width, height);
    }
    let whole = undistort_photo(photo, window);
    if (width, height) == (whole.width, whole.height) { whole } else { shrink_photo(&whole, width, height) }
}

fn load_mask(path: &Path, photo: (u32, u32), resampled: &AtomicUsize) -> Result<LabelMap> {
    let ids = read_checked(path, |found| {
        if same_aspect(found, photo) {
            return Ok(());
        }
        let problem = format!(
            "the mask has {} x {} px and its photo {} x {} px, which no scale explains; make masks of the same photos",
            found.0, found.1, photo.0, photo.1
        );
        Err(Error::data(path, "", problem))
    })?;
    if (ids.width, ids.height) != photo {
        resampled.fetch_add(1, Relaxed);
    }
    Ok(ids)
}
