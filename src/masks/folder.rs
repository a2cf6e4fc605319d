//! Assigns the files in a mask folder to photos.

use super::Format;
use super::mask_folder::png_key;
use labelgs_files::names::claim;
use labelgs_files::photo_files::photo_keys;
use labelgs_files::read;
use labelgs_scene::{Error, Result, Setting};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Subfolders in which data sets and trackers keep masks, with their formats.
const KNOWN_SUBFOLDERS: [(&str, &[Format]); 4] = [
    ("Annotations", &[Format::DevaLong, Format::DevaShort, Format::Palette]),
    ("object_mask", &[Format::ObjectMask]),
    ("test_mask", &[Format::LerfMask]),
    ("segmentations", &[Format::ThreeDOvs]),
];

/// Returns the folder with the masks: `folder` or a known subfolder.
pub(super) fn root(folder: &Path, format: Format) -> Result<PathBuf> {
    if !folder.is_dir() {
        return Err(Error::data(folder, "", "there is no such mask folder"));
    }
    let inside = KNOWN_SUBFOLDERS.iter().filter(|(name, _)| folder.join(name).is_dir());
    if format != Format::Auto {
        let fitting = inside.into_iter().find(|(_, formats)| formats.contains(&format));
        return Ok(fitting.map_or(folder.to_owned(), |(name, _)| folder.join(name)));
    }
    let names = read::folder(folder)?;
    let names = names.iter().filter_map(|path| path.file_name());
    if names.into_iter().any(|name| png_key(&name.to_string_lossy()).is_some()) {
        return Ok(folder.to_owned());
    }
    match *inside.map(|(name, formats)| (*name, formats[0])).collect::<Vec<_>>() {
        [] => Ok(folder.to_owned()),
        [(name, _)] => Ok(folder.join(name)),
        ref several => {
            let names: Vec<&str> = several.iter().map(|(name, _)| *name).collect();
            let formats: Vec<String> = several.iter().map(|(_, format)| Setting("format").to(format.name())).collect();
            let problem = format!(
                "holds masks in more than one format ({}); name one of these folders, or set {}",
                names.join(", "),
                formats.join(" or ")
            );
            Err(Error::data(folder, "", problem))
        }
    }
}

/// The files of each photo in one layout.
#[derive(Clone, Debug, Default)]
pub(super) struct Claims {
    /// For each photo, its files and their objects. The object is empty if the file shows all objects.
    pub(super) of_photo: Vec<Vec<(String, String)>>,
    /// PNG files without a photo.
    pub(super) strays: Vec<String>,
}

impl Claims {
    pub(super) fn photos(&self) -> usize {
        self.of_photo.iter().filter(|files| !files.is_empty()).count()
    }

    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        self.of_photo.iter().flatten().map(|(_, file)| file.as_str())
    }

    /// Uses a name for the object of files that show all objects.
    pub(super) fn into_one_object(mut self) -> Self {
        self.of_photo.iter_mut().flatten().for_each(|(object, _)| *object = "object".to_owned());
        self
    }

    /// Returns the names of the objects, in numeric order if all are numbers, otherwise in alphabetical order.
    pub(super) fn objects(&self) -> Vec<String> {
        let names: BTreeSet<&String> = self.of_photo.iter().flatten().map(|(object, _)| object).collect();
        let mut names: Vec<String> = names.into_iter().cloned().collect();
        if names.iter().all(|name| name.parse::<u64>().is_ok()) {
            names.sort_by_key(|name| (name.parse::<u64>().unwrap_or(u64::MAX), name.clone()));
        }
        names
    }
}

fn claims<'a>(
    keys: &[Vec<String>],
    files: &[(&'a str, &'a str)],
    split: impl Fn(&'a str) -> Option<(&'a str, &'a str)>,
) -> Claims {
    // Object, then key of the photo, then file.
    let mut there: BTreeMap<&str, BTreeMap<&str, &str>> = BTreeMap::new();
    for (key, file) in files {
        if let Some((object, photo)) = split(key) {
            there.entry(object).or_default().insert(photo, file);
        }
    }
    let mut of_photo = vec![Vec::new(); keys.len()];
    let mut claimed = BTreeSet::new();
    for (object, of_object) in &there {
        let names = of_object.keys().copied().collect();
        for (photo, key) in claim(keys, &names).into_iter().enumerate() {
            if let Some(file) = key.and_then(|key| of_object.get(key.as_str())) {
                claimed.insert(*file);
                of_photo[photo].push(((*object).to_owned(), (*file).to_owned()));
            }
        }
    }
    let strays = files.iter().map(|(_, file)| *file).filter(|file| !claimed.contains(file)).map(str::to_owned);
    Claims { of_photo, strays: strays.collect() }
}

/// The files in each of the three layouts.
pub(super) struct Layouts {
    /// `NAME.png`.
    pub(super) flat: Claims,
    /// `OBJECT/NAME.png`.
    pub(super) by_object: Claims,
    /// `NAME/OBJECT.png`.
    pub(super) by_photo: Claims,
}

/// Matches a list of files with each layout.
pub(super) fn layouts(photos: &[&str], files: &[String]) -> Layouts {
    let keys = photo_keys(photos);
    let pngs: Vec<(&str, &str)> =
        files.iter().filter_map(|file| png_key(file).map(|key| (key, file.as_str()))).collect();
    Layouts {
        flat: claims(&keys, &pngs, |key| Some(("", key))),
        by_object: claims(&keys, &pngs, |key| key.split_once('/')),
        by_photo: claims(&keys, &pngs, |key| key.rsplit_once('/').map(|(photo, object)| (object, photo))),
    }
}
