//! Loads a data set from a listing: split, decode, undistort, resize, masks.

use super::listing::{Listed, Listing};
use super::photo_store::PhotoStore;
use super::recipe::{MadeView, MadeViews, Recipe};
use super::{LoadOptions, bad_photos, frame_check, mask_notes, missing, stray};
use labelgs_files::all::all_or_one_error;
use labelgs_files::names::shortened;
use labelgs_masks as masks;
use labelgs_masks::mask_folder::MaskFolder;
use labelgs_scene::words::counted;
use labelgs_scene::{Dataset, Flaw, Photo, View, crew};
use labelgs_scene::{Error, Result, Setting};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

pub fn load(root: &Path, mut listing: Listing, options: &LoadOptions) -> Result<Dataset> {
    let mut notes = std::mem::take(&mut listing.notes);
    let mut faults = Vec::new();
    let mut views = missing::existing(&listing, options, &mut notes, &mut faults)?;
    stray::remove(&mut views, &listing.points, options.max_bad_photos, &mut faults);
    views.sort_by(|a, b| a.name.cmp(&b.name));
    let mut test = split(&views, options.test_every, &mut notes)?;
    if let Some(only) = &options.only {
        limit(root, &mut views, &mut test, only)?;
    }
    let open = |folder: &Path| MaskFolder::new(folder, views.iter().map(|view| view.name.as_str()));
    let masks = options.masks.as_deref().map(open).transpose()?;
    let ignore = options.ignore.as_deref().map(open).transpose()?;
    if let Some(ignore) = &ignore {
        note_missing(root, ignore, &views, "picture of what to ignore", &mut notes)?;
    }
    let recipe = |(view, &test): (&Listed, &bool)| {
        let of = |folder: &Option<MaskFolder>| folder.as_ref().and_then(|folder| folder.find(&view.name));
        Arc::new(Recipe::new((view.clone(), listing.source.clone()), [of(&masks), of(&ignore)], test, options))
    };
    let recipes: Vec<Arc<Recipe>> = views.iter().zip(&test).map(recipe).collect();
    let Read { photos, resampled, blank } = read_views(&recipes, &test, options);
    let mut undecodable = std::mem::take(&mut listing.bad);
    let total = views.len() + undecodable.len();
    let mut loaded = Vec::with_capacity(views.len());
    for (views, test) in photos.into_iter().zip(test) {
        match views {
            Ok(views) => loaded.push(views.map(|views| (views, test))),
            Err(error) => undecodable.push(error),
        }
    }
    bad_photos::skip(root, undecodable, total, options, &mut faults)?;
    let loaded: Vec<(Vec<View>, bool)> = all_or_one_error(root, loaded)?;
    if let Some(masks) = &masks {
        note_missing(root, masks, &views, "mask", &mut notes)?;
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
    let flaws: Vec<Flaw> =
        std::mem::take(&mut listing.flaws).into_iter().chain(faults.into_iter().map(Flaw::LeftOut)).collect();
    notes.extend(flaws.iter().map(|flaw| flaw.text().to_owned()));
    let (train, test) = divided(loaded, options.only.as_deref());
    let Listing { source, native, points, .. } = listing;
    let mut dataset = Dataset { root: root.to_owned(), source, train, test, points, notes, flaws };
    // Some of the views say nothing about all masks.
    if let (Some(masks), None) = (&masks, &options.only) {
        dataset.notes.extend(mask_notes::notes(masks, &dataset));
    }
    require_unique(root, &dataset)?;
    // Faces of wide photos are turned against them.
    let native = Some(native).filter(|_| !is_wide && options.lookup.poses.is_native());
    frame_check::check(&mut dataset, native, options.lookup.poses)?;
    Ok(dataset)
}

/// Divides the views into those to train on and those held out, each sorted by name.
fn divided(loaded: Vec<(Vec<View>, bool)>, only: Option<&BTreeSet<String>>) -> (Vec<View>, Vec<View>) {
    let (mut train, mut test) = (Vec::new(), Vec::new());
    for (views, is_test) in loaded {
        if is_test { test.extend(views) } else { train.extend(views) }
    }
    for views in [&mut train, &mut test] {
        views.retain(|view| only.is_none_or(|only| only.contains(&view.name)));
        // Faces of a photo are not in the order of their names.
        views.sort_by(|a, b| a.name.cmp(&b.name));
    }
    (train, test)
}

/// Notes the photos of which there are several views; returns whether there are any.
fn note_wide(loaded: &[(Vec<View>, bool)], notes: &mut Vec<String>) -> bool {
    let wide: Vec<&Vec<View>> = loaded.iter().map(|(views, _)| views).filter(|views| views.len() > 1).collect();
    if !wide.is_empty() {
        let faces: usize = wide.iter().map(|views| views.len()).sum();
        notes.push(format!("{} photos are wider than a pinhole picture and became {faces} faces of cubes", wide.len()));
    }
    !wide.is_empty()
}

/// Notes the photos without a picture in the folder; refuses one without any.
fn note_missing(root: &Path, masks: &MaskFolder, views: &[Listed], what: &str, notes: &mut Vec<String>) -> Result<()> {
    let without = views.iter().filter(|view| masks.find(&view.name).is_none()).map(|view| view.name.as_str());
    let without: Vec<&str> = without.collect();
    if without.len() == views.len() {
        let photos: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
        return Err(masks::tools::nothing_found(masks, root, &photos));
    }
    if !without.is_empty() {
        notes.push(format!("{} of {} photos have no {what}: {}", without.len(), views.len(), shortened(&without)));
    }
    Ok(())
}

/// Notes the views without a pixel that counts; refuses a scene of nothing else.
fn note_blank(root: &Path, blank: &[String], is_all: bool, notes: &mut Vec<String>) -> Result<()> {
    if blank.is_empty() {
        return Ok(());
    }
    let names: Vec<&str> = blank.iter().map(String::as_str).collect();
    let problem = format!("{} have no pixel that counts: all are ignored, or outside of the lens", shortened(&names));
    if is_all {
        return Err(Error::data(root, "photos", problem + "; check what is ignored and the coefficients of the lens"));
    }
    notes.push(format!("{} views are skipped, because {problem}", names.len()));
    Ok(())
}

/// Keeps the views that are asked for, and which of them are held out.
fn limit(root: &Path, views: &mut Vec<Listed>, test: &mut Vec<bool>, only: &BTreeSet<String>) -> Result<()> {
    // Photos of wide lenses have their views below their names.
    let kept: Vec<bool> = views.iter().map(|view| only.contains(&view.name) || !view.lens.is_pinhole()).collect();
    retain(views, &kept);
    retain(test, &kept);
    if views.is_empty() {
        return Err(Error::data(root, "photos", "none of the asked ones is in the scene"));
    }
    Ok(())
}

/// Keeps the items whose flag is set.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut flags = kept.iter();
    items.retain(|_| flags.next() == Some(&true));
}

/// What is read of all photos.
struct Read {
    /// Views of each. The outer error is that of an undecodable photo.
    photos: Vec<Result<Result<Vec<View>>>>,
    /// Number of masks with another size than their photos.
    resampled: usize,
    /// Names of the views without a valid pixel, which are left out: nothing can be learned or scored there.
    blank: Vec<String>,
}

/// Makes the views of each photo.
fn read_views(recipes: &[Arc<Recipe>], test: &[bool], options: &LoadOptions) -> Read {
    let stored: Vec<_> = recipes.par_iter().map(|recipe| recipe.stored()).collect();
    let store = PhotoStore::new(recipes, &stored, test, options);
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
    let read = crew::map("reading photos", recipes.len(), store.at_once(), read);
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
    Read { photos, resampled, blank }
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

/// Returns which of the views, sorted by name, are held out.
fn split(views: &[Listed], every: Option<u32>, notes: &mut Vec<String>) -> Result<Vec<bool>> {
    let Some(every) = every else { return Ok(vec![false; views.len()]) };
    if views.iter().all(|view| view.test.is_some()) {
        return Ok(views.iter().map(|view| view.test == Some(true)).collect());
    }
    if every == 0 {
        return Err(Error::usage(Setting("test_every"), "0 holds out nothing and everything; expected 1 or more"));
    }
    if views.len() == 1 && every > 1 {
        notes.push("the only photo is used for training; nothing is held out".into());
        return Ok(vec![false]);
    }
    Ok((0..views.len()).map(|index| index % every as usize == 0).collect())
}
