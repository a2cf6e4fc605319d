//! A folder of masks: the file of each photo.

use labelgs_files::names::{below, claim, shortened};
use labelgs_scene::{Error, Result};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Names by how many photos have them.
struct PhotoNames {
    /// Per file stem. A flat folder serves only unique stems.
    stems: HashMap<String, usize>,
    /// Per path cut at the first dot of the file name, for the same reason.
    cut: HashMap<PathBuf, usize>,
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Cuts the file name of a path at its first dot, as Gaussian Grouping does.
fn cut_at_first_dot(name: &str) -> PathBuf {
    let path = Path::new(name);
    let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(file.split('.').next().unwrap_or_default())
}

impl PhotoNames {
    /// Makes it from the names of all photos of the scene.
    fn new(names: &[&str]) -> Self {
        let (mut stems, mut cut) = (HashMap::new(), HashMap::new());
        for &name in names {
            *stems.entry(stem(name)).or_insert(0) += 1;
            *cut.entry(cut_at_first_dot(name)).or_insert(0) += 1;
        }
        Self { stems, cut }
    }

    /// Returns the possible names for the mask of `name`, without `.png`, in order of preference: the photo's name
    /// without its extension, with it, cut at the first dot of the file name, and the first two without folders. The
    /// last three need a name that no other photo shares.
    fn keys(&self, name: &str) -> Vec<PathBuf> {
        let path = Path::new(name);
        let mut found = vec![path.with_extension(""), path.to_owned()];
        let cut = cut_at_first_dot(name);
        if self.cut.get(&cut) == Some(&1) {
            found.push(cut);
        }
        if self.stems.get(&stem(name)) == Some(&1) {
            found.push(stem(name).into());
            found.extend(path.file_name().map(PathBuf::from));
        }
        found
    }
}

/// Returns the possible mask names of each photo, without `.png`, in order of preference.
pub fn photo_keys(photos: &[&str]) -> Vec<Vec<String>> {
    let names = PhotoNames::new(photos);
    let keys = |photo: &&str| {
        let keys = names.keys(photo).into_iter();
        let mut keys: Vec<String> = keys.map(|key| key.to_string_lossy().replace('\\', "/")).collect();
        // DEVA removes the last four characters, whatever the extension is: `a.jpeg` becomes `a..png`.
        let cut = photo.len().checked_sub(4).and_then(|at| photo.get(..at));
        keys.extend(cut.filter(|cut| cut.ends_with('.')).map(str::to_owned));
        keys
    };
    photos.iter().map(keys).collect()
}

/// Returns `name` without `.png` (any case), or `None` for other files.
pub fn png_key(name: &str) -> Option<&str> {
    let at = name.len().checked_sub(4)?;
    name.get(at..)?.eq_ignore_ascii_case(".png").then(|| &name[..at])
}

/// Appends `.png` to `key`, which may contain dots.
pub fn with_png(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".png");
    name.into()
}

/// A folder of masks that are found by the name of the photo.
pub struct MaskFolder {
    /// The folder.
    pub folder: PathBuf,
    of_photo: BTreeMap<String, PathBuf>,
}

impl MaskFolder {
    /// Finds the masks in the folder; `names` are those of all photos of the scene.
    pub fn new<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<Self> {
        if folder.is_file() {
            let problem = "is a file, expected a folder of id masks; masks in one file, such as COCO's, become one by \
                           `masks import` with the scene";
            return Err(Error::data(folder, "", problem));
        }
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder"));
        }
        let photos: Vec<&str> = names.collect();
        let keys = photo_keys(&photos);
        let own = |key: &String| Some(folder.join(with_png(Path::new(key)))).filter(|path| path.is_file());
        let mut found: Vec<Option<PathBuf>> = keys.iter().map(|keys| keys.iter().find_map(own)).collect();
        // A folder is listed only where a mask is missing, because it may be large.
        if found.iter().any(Option::is_none) {
            let files = below(folder)?;
            let there: BTreeMap<&str, &String> =
                files.iter().filter_map(|file| png_key(file).map(|key| (key, file))).collect();
            let claimed = claim(&keys, &there.keys().copied().collect());
            for (found, key) in found.iter_mut().zip(claimed).filter(|(found, _)| found.is_none()) {
                *found = key.and_then(|key| there.get(key.as_str()).map(|file| folder.join(file)));
            }
        }
        let of_photo = photos.iter().zip(found).filter_map(|(name, path)| Some(((*name).to_owned(), path?)));
        Ok(Self { folder: folder.to_owned(), of_photo: of_photo.collect() })
    }

    /// Returns the mask file of `name`, if there is one.
    pub fn find(&self, name: &str) -> Option<PathBuf> {
        self.of_photo.get(name).cloned()
    }

    /// Returns the mask files with the names of their photos, sorted by name.
    pub fn files(&self) -> impl ExactSizeIterator<Item = (&str, &Path)> {
        self.of_photo.iter().map(|(name, path)| (name.as_str(), path.as_path()))
    }

    /// Makes the error for a folder without a mask for any photo.
    pub fn nothing_found(&self, name: &str) -> Error {
        let expected = Path::new(name).with_extension("png");
        let mut text = format!("has a PNG for no photo of the scene; expected for example {}", expected.display());
        if ["jpg", "jpeg", "JPG"].iter().any(|ext| self.folder.join(expected.with_extension(ext)).is_file()) {
            text.push_str("; JPEG is refused because compression changes ids, write PNG");
        } else if let Ok(files) = below(&self.folder) {
            let there = if files.is_empty() { "nothing".to_owned() } else { shortened(&files) };
            text.push_str(&format!("; it holds {there}"));
        }
        Error::data(&self.folder, "", text)
    }
}
