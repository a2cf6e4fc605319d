//! The files in a folder that belong to photos by name, such as masks and depth maps.

use super::names::{below, claim};
use labelgs_scene::Result;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// A folder whose files are found by photo name.
#[derive(Debug)]
pub struct PhotoFiles {
    /// The folder.
    pub folder: PathBuf,
    of_photo: BTreeMap<String, PathBuf>,
}

impl PhotoFiles {
    /// Finds the files of `photos`, which are all photos of a scene, by [`photo_keys`]. Prefers earlier extensions.
    pub fn new(folder: &Path, photos: &[&str], extensions: &[&str]) -> Result<Self> {
        let keys = photo_keys(photos);
        let own = |key: &String| {
            let files = extensions.iter().map(|extension| folder.join(format!("{key}.{extension}")));
            files.into_iter().find(|path| path.is_file())
        };
        let mut found: Vec<Option<PathBuf>> = keys.iter().map(|keys| keys.iter().find_map(own)).collect();
        // List a folder only if a file is missing, because the folder may be large.
        if found.iter().any(Option::is_none) {
            let files = below(folder)?;
            let of = |&extension| files.iter().filter_map(move |file| Some((key_of(file, extension)?, file)));
            // Later entries replace earlier ones.
            let there: BTreeMap<&str, &String> = extensions.iter().rev().flat_map(of).collect();
            let claimed = claim(&keys, &there.keys().copied().collect());
            for (found, key) in found.iter_mut().zip(claimed).filter(|(found, _)| found.is_none()) {
                *found = key.and_then(|key| there.get(key.as_str()).map(|file| folder.join(file)));
            }
        }
        let of_photo = photos.iter().zip(found).filter_map(|(name, path)| Some(((*name).to_owned(), path?)));
        Ok(Self { folder: folder.to_owned(), of_photo: of_photo.collect() })
    }

    /// Returns the file of the photo `name`, if there is one.
    pub fn find(&self, name: &str) -> Option<&Path> {
        self.of_photo.get(name).map(PathBuf::as_path)
    }

    /// Returns the files with the names of their photos, sorted by name.
    pub fn files(&self) -> impl ExactSizeIterator<Item = (&str, &Path)> {
        self.of_photo.iter().map(|(name, path)| (name.as_str(), path.as_path()))
    }
}

/// Returns the possible names of each photo's file, without extension, in order of preference: the photo's name without
/// its extension, with it, cut at the first dot of the file name as Gaussian Grouping does, and the first two without
/// folders. The last three only count if no other photo shares the name.
pub fn photo_keys(photos: &[&str]) -> Vec<Vec<String>> {
    let (mut stems, mut cuts) = (HashMap::new(), HashMap::new());
    for &photo in photos {
        *stems.entry(stem(photo)).or_insert(0) += 1;
        *cuts.entry(cut_at_first_dot(photo)).or_insert(0) += 1;
    }
    let keys = |&photo: &&str| {
        let path = Path::new(photo);
        let mut found = vec![path.with_extension(""), path.to_owned()];
        found.extend(Some(cut_at_first_dot(photo)).filter(|cut| cuts.get(cut) == Some(&1)));
        if stems.get(&stem(photo)) == Some(&1) {
            found.push(stem(photo));
            found.extend(path.file_name().map(PathBuf::from));
        }
        let mut keys: Vec<String> = found.iter().map(|key| key.to_string_lossy().replace('\\', "/")).collect();
        // DEVA removes the last four characters, whatever the extension: `a.jpeg` becomes `a..png`.
        let cut = photo.len().checked_sub(4).and_then(|at| photo.get(..at));
        keys.extend(cut.filter(|cut| cut.ends_with('.')).map(str::to_owned));
        keys
    };
    photos.iter().map(keys).collect()
}

fn stem(name: &str) -> PathBuf {
    Path::new(name).file_stem().map(PathBuf::from).unwrap_or_default()
}

fn cut_at_first_dot(name: &str) -> PathBuf {
    let path = Path::new(name);
    let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(file.split('.').next().unwrap_or_default())
}

/// Returns `name` without this extension (in any case), or `None` for other files.
pub fn key_of<'a>(name: &'a str, extension: &str) -> Option<&'a str> {
    let at = name.len().checked_sub(extension.len() + 1)?;
    let ending = name.get(at..)?.strip_prefix('.')?;
    ending.eq_ignore_ascii_case(extension).then(|| &name[..at])
}
