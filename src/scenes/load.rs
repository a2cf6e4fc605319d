//! Loads a data set from a listing: split, decode, undistort, resize, masks.

use super::listing::{ListedPhoto, Listing};
use super::photo_recipe::{MadeView, MadeViews, PhotoRecipe};
use super::photo_store::PhotoStore;
use super::{LoadOptions, bad_photos, frame_check, init, mask_notes, missing, outlier_poses};
use labelgs_files::error_list::all_or_one_error;
use labelgs_files::names::shortened;
use labelgs_files::photo_files::PhotoFiles;
use labelgs_masks::mask_folder::masks_of_photos;
use labelgs_masks::tools::nothing_found;
use labelgs_scene::words::counted;
use labelgs_scene::{Dataset, Photo, SceneProblem, View, parallel};
use labelgs_scene::{Error, Result, Setting};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub fn load(root: &Path, mut listing: Listing, options: &LoadOptions) -> Result<Dataset> {
    let mut notes = std::mem::take(&mut listing.notes);
    let mut faults = Vec::new();
    let mut views = missing::existing(&listing, options, &mut notes, &mut faults)?;
    outlier_poses::remove(&mut views, &listing.points, options.max_bad_photos, &mut faults);
    views.sort_by(|a, b| a.name.cmp(&b.name));
    split(&mut views, options.test_every, &mut notes)?;
    if let Some(only) = &options.only {
        // Views of wide photos have names derived from the photo's.
        views.retain(|view| only.contains(&view.name) || !view.lens.is_pinhole());
        if views.is_empty() {
            return Err(Error::data(root, "photos", "none of the requested ones is in the scene"));
        }
    }
    let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
    let open = |folder: &PathBuf| masks_of_photos(folder, &names);
    let masks = options.masks.as_ref().map(open).transpose()?;
    let ignore = options.ignore.as_ref().map(open).transpose()?;
    if let Some(ignore) = &ignore {
        note_missing(root, ignore, &names, "picture of what to ignore", &mut notes)?;
    }
    let recipe = |view: &ListedPhoto| {
        let of = |files: &Option<PhotoFiles>| files.as_ref()?.find(&view.name).map(Path::to_owned);
        Arc::new(PhotoRecipe::new((view.clone(), listing.source.clone()), [of(&masks), of(&ignore)], options))
    };
    let recipes: Vec<Arc<PhotoRecipe>> = views.iter().map(recipe).collect();
    let LoadedViews { photos, resampled, blank } = read_views(&recipes, options);
    let mut undecodable = std::mem::take(&mut listing.bad);
    let total = views.len() + undecodable.len();
    let mut loaded = Vec::with_capacity(views.len());
    for (made, view) in photos.into_iter().zip(&views) {
        match made {
            Ok(made) => loaded.push(made.map(|made| (made, view.test == Some(true)))),
            Err(error) => undecodable.push(error),
        }
    }
    bad_photos::skip(root, undecodable, total, options, &mut faults)?;
    let loaded: Vec<(Vec<View>, bool)> = all_or_one_error(root, loaded)?;
    if let Some(masks) = &masks {
        note_missing(root, masks, &names, "mask", &mut notes)?;
    }
    note_blank(root, &blank, loaded.iter().all(|(views, _)| views.is_empty()), &mut notes)?;
    if resampled > 0 {
        let masks = counted(resampled, "mask");
        notes.push(format!("{masks} of another size than their photos were scaled (nearest id)"));
    }
    if options.undistort && views.iter().any(|view| !view.lens.is_pinhole()) {
        notes.push("photos and masks were undistorted to a pinhole camera; pixels without a source are ignored".into());
    }
    let is_wide = note_wide(&loaded, &mut notes);
    let flaws: Vec<_> = listing.flaws.into_iter().chain(faults.into_iter().map(SceneProblem::LeftOut)).collect();
    notes.extend(flaws.iter().map(|flaw| flaw.text().to_owned()));
    let (train, test) = divided(loaded, options.only.as_deref());
    let Listing { source, native, points, .. } = listing;
    let mut dataset = Dataset { root: root.to_owned(), source, train, test, objects_only: false, points, notes, flaws };
    // A subset of the views does not represent all masks.
    if let (Some(masks), None) = (&masks, &options.only) {
        dataset.notes.extend(mask_notes::notes(masks, &dataset));
    }
    require_unique(root, &dataset)?;
    // Cube faces are rotated against their photos.
    let native = Some(native).filter(|_| !is_wide && options.lookup.poses.is_native());
    frame_check::check(&mut dataset, native, options.lookup.poses)?;
    if options.masked_only && options.photos { without_surroundings(dataset) } else { Ok(dataset) }
}

/// Turns the scene into isolated objects and drops the points that masks show to be outside them.
fn without_surroundings(mut dataset: Dataset) -> Result<Dataset> {
    let places: Vec<_> = dataset.points.iter().map(|point| point.position).collect();
    dataset.objects_only = true;
    let mut inside = init::inside(&dataset, &places)?.into_iter();
    let before = dataset.points.len();
    dataset.points.retain(|_| inside.next() == Some(true));
    if dataset.points.len() < before {
        let left_out = counted(before - dataset.points.len(), "point");
        dataset.notes.push(format!("{left_out} of {before} lie outside the objects, by their masks, and are omitted"));
    }
    Ok(dataset)
}

/// Divides the views into training and held-out ones, each sorted by name.
fn divided(loaded: Vec<(Vec<View>, bool)>, only: Option<&BTreeSet<String>>) -> (Vec<View>, Vec<View>) {
    let (mut train, mut test) = (Vec::new(), Vec::new());
    for (views, is_test) in loaded {
        if is_test { test.extend(views) } else { train.extend(views) }
    }
    for views in [&mut train, &mut test] {
        views.retain(|view| only.is_none_or(|only| only.contains(&view.name)));
        // Cube faces are not in the order of their names.
        views.sort_by(|a, b| a.name.cmp(&b.name));
    }
    (train, test)
}

/// Notes the photos with several views, and returns whether there are any.
fn note_wide(loaded: &[(Vec<View>, bool)], notes: &mut Vec<String>) -> bool {
    let wide: Vec<&Vec<View>> = loaded.iter().map(|(views, _)| views).filter(|views| views.len() > 1).collect();
    if !wide.is_empty() {
        let faces: usize = wide.iter().map(|views| views.len()).sum();
        notes.push(format!("{} photos are too wide for a pinhole view and became {faces} cube faces", wide.len()));
    }
    !wide.is_empty()
}

/// Notes the photos without a file in the folder; errors if none has one.
fn note_missing(root: &Path, files: &PhotoFiles, photos: &[&str], what: &str, notes: &mut Vec<String>) -> Result<()> {
    let without: Vec<&str> = photos.iter().copied().filter(|name| files.find(name).is_none()).collect();
    if without.len() == photos.len() {
        return Err(nothing_found(&files.folder, root, photos));
    }
    if !without.is_empty() {
        notes.push(format!("{} of {} photos have no {what}: {}", without.len(), photos.len(), shortened(&without)));
    }
    Ok(())
}

/// Notes the views without a valid pixel; errors if all views are blank.
fn note_blank(root: &Path, blank: &[String], is_all: bool, notes: &mut Vec<String>) -> Result<()> {
    if blank.is_empty() {
        return Ok(());
    }
    let problem = format!(
        "{} have no valid pixel: all are ignored, outside the lens, or without the mask of an object where objects \
         alone are trained",
        shortened(blank)
    );
    if is_all {
        return Err(Error::data(root, "photos", problem + "; check what is ignored and the coefficients of the lens"));
    }
    notes.push(format!("{} views are skipped, because {problem}", blank.len()));
    Ok(())
}

/// The views of all photos.
struct LoadedViews {
    /// Views of each photo. The outer error is that of an undecodable photo.
    photos: Vec<Result<Result<Vec<View>>>>,
    /// Number of masks whose size differs from their photos'.
    resampled: usize,
    /// Names of the views without a valid pixel. They are omitted, because nothing can be trained or scored there.
    blank: Vec<String>,
}

/// Creates the views of each photo.
fn read_views(recipes: &[Arc<PhotoRecipe>], options: &LoadOptions) -> LoadedViews {
    let stored: Vec<_> = recipes.par_iter().map(|recipe| recipe.stored()).collect();
    let store = PhotoStore::new(recipes, &stored, options);
    let read = |index: usize| {
        let (recipe, size) = (&recipes[index], *stored[index].as_ref().ok()?);
        let made = recipe.decode(size).map(|photo| recipe.views(size, photo));
        let kept = |made: MadeViews| {
            let counts = |view: &MadeView| view.photo.as_ref().is_none_or(Photo::has_valid);
            let counts: Vec<bool> = made.views.iter().map(counts).collect();
            (made.resampled, store.keep(index, recipe, size, made.views).into_iter().zip(counts).collect())
        };
        Some(made.map(|made| made.map(kept)))
    };
    let read = parallel::map_bounded("reading photos", recipes.len(), store.at_once(), read);
    let (mut resampled, mut blank) = (0, Vec::new());
    let mut count = |(masks, views): (usize, Vec<(View, bool)>)| {
        resampled += masks;
        let (views, left_out): (Vec<_>, Vec<_>) = views.into_iter().partition(|&(_, counts)| counts);
        blank.extend(left_out.into_iter().map(|(view, _)| view.name));
        views.into_iter().map(|(view, _)| view).collect()
    };
    let of_photo = |(size, made): (Result<_>, Option<Result<Result<_>>>)| match (size, made) {
        (Err(error), _) => Err(error),
        (Ok(_), Some(made)) => made.map(|made| made.map(&mut count)),
        (Ok(_), None) => Err(Error::Bug("a photo of known size was not read".to_owned())),
    };
    let photos = stored.into_iter().zip(read).map(of_photo).collect();
    LoadedViews { photos, resampled, blank }
}

/// Refuses a photo with the name of another photo's cube face.
fn require_unique(root: &Path, dataset: &Dataset) -> Result<()> {
    let all = dataset.all();
    match all.windows(2).find(|pair| pair[0].name == pair[1].name) {
        Some(pair) => {
            let problem = "is the name of both a photo and a cube face of a wide photo; rename the photo";
            Err(Error::data(root, format!("view {}", pair[0].name), problem))
        }
        None => Ok(()),
    }
}

/// Decides which of the views, sorted by name, are held out.
fn split(views: &mut [ListedPhoto], every: Option<u32>, notes: &mut Vec<String>) -> Result<()> {
    let Some(every) = every else {
        views.iter_mut().for_each(|view| view.test = Some(false));
        return Ok(());
    };
    if views.iter().all(|view| view.test.is_some()) {
        return Ok(());
    }
    if every == 0 {
        return Err(Error::usage(Setting("test_every"), "must be at least 1; omit it to hold out no views"));
    }
    let is_alone = views.len() == 1 && every > 1;
    if is_alone {
        notes.push("the only photo is used for training; nothing is held out".into());
    }
    let held_out = |index: usize| !is_alone && index.is_multiple_of(every as usize);
    views.iter_mut().enumerate().for_each(|(index, view)| view.test = Some(held_out(index)));
    Ok(())
}
