//! Lists a scene's photos, whatever its format.

use super::listed_path::SceneFolder;
use super::listing::Listing;
use super::lookup::Lookup;
use super::photo_finder::count_photos;
use super::split::SceneSplit;
use super::{colmap, llff, metashape, transforms};
use labelgs_files::content::{self, Content};
use labelgs_files::names::shortened;
use labelgs_scene::error::Verb;
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Result, SceneProblem, Setting};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// If at most one of this many photos in a folder has no pose, there is no note: programs that find poses drop some.
const UNPOSED_ONE_OF: usize = 10;

/// Makes a scene of photos without poses, as [`super::reconstruction`] does.
const MAKE_SCENE: Verb = Verb("photos");

/// Returns the folder of a scene, given the folder or one file in it.
pub(super) fn folder_of(scene: &Path) -> &Path {
    if !scene.is_file() {
        return scene;
    }
    scene.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Lists a scene: a folder, or a file that lists photos.
pub(super) fn list(scene: &Path, lookup: &Lookup) -> Result<Listing> {
    if let Some(images) = lookup.images_of(folder_of(scene))
        && !images.is_dir()
    {
        return Err(Error::usage(
            Setting("images"),
            format!("{} is not a folder; expected the folder of the photos", images.display()),
        ));
    }
    let place = SceneFolder::new(folder_of(scene), lookup);
    let mut listing = if scene.is_file() { list_file(&place, scene)? } else { list_folder(&place, scene)? };
    listing.notes.extend(place.photos.note());
    if listing.is_incomplete() {
        listing.hint = place.photos.hint() + &listing.hint;
    }
    if listing.views.iter().all(|view| view.test.is_none())
        && let Some(split) = SceneSplit::find(&place, &listing.source)?
    {
        split.apply(&mut listing);
    }
    let native = listing.native;
    listing.views.iter_mut().for_each(|view| lookup.poses.apply(native, &mut view.camera));
    Ok(listing)
}

fn list_file(place: &SceneFolder, scene: &Path) -> Result<Listing> {
    let extension = scene.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("npy") => llff::list_file(place, scene),
        Some("xml") => metashape::list_file(place, scene),
        _ => match content::identify_file(scene)? {
            Some(content) => Err(Error::data(scene, "", no_scene(content))),
            None => transforms::list_file(place, scene),
        },
    }
}

fn list_folder(place: &SceneFolder, scene: &Path) -> Result<Listing> {
    if !scene.is_dir() {
        return Err(Error::data(scene, "", "there is no such folder; expected the folder of a scene"));
    }
    for (at, list) in [colmap::list, transforms::list, llff::list, metashape::list].into_iter().enumerate() {
        match list(place) {
            Ok(None) => {}
            Ok(Some(mut listing)) => {
                name_others(scene, at, &mut listing);
                if at == 0 {
                    let unposed = without_pose(&listing).map(SceneProblem::Unposed);
                    listing.flaws.extend(unposed);
                }
                return Ok(listing);
            }
            Err(Error::Data { path, place, problem }) => {
                let other = others(scene, at).into_iter().next();
                let hint =
                    other.map_or(String::new(), |(other, _)| format!("; or name {} as the scene", other.display()));
                return Err(Error::data(path, place, problem + &hint));
            }
            Err(error) => return Err(error),
        }
    }
    let mut problem = "holds no scene: expected a COLMAP model (cameras and images, .bin or .txt, in sparse/0, sparse \
                       or colmap/sparse/0), transforms.json or transforms_train.json, poses_bounds.npy, or the cameras of \
                       Metashape as .xml"
        .to_owned();
    if let Some((folder, count)) = place.photos.most_photos() {
        problem += &format!(
            ". {} holds {} without poses: {} finds the poses with COLMAP",
            folder.display(),
            counted(count, "photo"),
            MAKE_SCENE.with(format!("{} -o SCENE", folder.display()))
        );
    }
    Err(Error::data(scene, "", problem))
}

/// Returns the other pose files in the folder of a scene, which reader `at` takes precedence over, with their numbers
/// of photos.
fn others(scene: &Path, at: usize) -> Vec<(PathBuf, Option<usize>)> {
    type Count = fn(&Path) -> Option<usize>;
    let lists: [(usize, &str, Count); 3] = [
        (1, "transforms.json", transforms::count),
        (1, "transforms_train.json", transforms::count),
        (2, "poses_bounds.npy", llff::count),
    ];
    let losing = lists.into_iter().filter(|&(reader, ..)| reader > at);
    let files = losing.map(|(_, name, count)| (scene.join(name), count)).filter(|(path, _)| path.is_file());
    files.map(|(path, count)| (path.clone(), count(&path))).collect()
}

/// Notes the other pose files in the folder of a scene. Data sets store their poses in several formats, so only a file
/// with other photos is worth a note.
fn name_others(scene: &Path, at: usize, listing: &mut Listing) {
    let used = listing.views.len() + listing.missing.len() + listing.bad.len();
    for (path, count) in others(scene, at) {
        let is_same = count == Some(used) && !listing.is_incomplete();
        if !is_same {
            let (source, path) = (listing.source.display(), path.display());
            let photos = count.map_or(String::new(), |count| format!(" with {}", counted(count, "photo")));
            listing.notes.push(format!(
                "poses of {} come from {source}; {path}{photos} also exists: name it as the scene to use it instead",
                counted(used, "photo")
            ));
            listing.hint += &format!("; or name {path} as the scene, which also exists");
        }
    }
}

/// Describes how many photos in the listing's folders have no pose, if they are many.
fn without_pose(listing: &Listing) -> Option<String> {
    let photos: BTreeSet<&Path> = listing.views.iter().filter_map(|view| view.photo.as_deref()).collect();
    let folders: BTreeSet<&Path> = photos.iter().filter_map(|photo| photo.parent()).collect();
    let all: usize = folders.iter().map(|folder| count_photos(folder)).sum();
    let without = all.saturating_sub(photos.len() + listing.bad.len());
    let names: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
    (without * UNPOSED_ONE_OF > all).then(|| {
        format!(
            "{without} of {} in {} have no pose in {}",
            counted(all, "photo"),
            shortened(&names),
            listing.source.display()
        )
    })
}

/// Describes a file that does not list photos, and what to do.
fn no_scene(content: Content) -> String {
    let Content { what, .. } = content;
    if what.starts_with("a video") {
        let make = MAKE_SCENE.with("VIDEO -o SCENE");
        return format!("is {what}, not a scene: {make} makes one of it with COLMAP");
    }
    format!("is {what}, not a scene; name the folder of a scene, or its transforms.json, poses_bounds.npy or .xml")
}
