//! Finds the file of a listed photo.
//!
//! Programs rename, convert and move photos after their poses are known. A photo that is not at its listed path is
//! looked for in the usual photo folders, under the same name in another case or Unicode composition, and then under
//! the same name with another extension. Only a unique match counts.

use labelgs_files::names::folded;
use labelgs_files::read;
use labelgs_scene::Setting;
use labelgs_scene::words::counted;
use std::cell::{OnceCell, RefCell};
use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Extensions of readable photos.
const READABLE_EXTENSIONS: [&str; 3] = ["png", "jpg", "jpeg"];
/// Extensions of unreadable photos. They are found too, so that messages can name them.
const UNREADABLE_EXTENSIONS: [&str; 13] =
    ["tif", "tiff", "webp", "heic", "heif", "avif", "bmp", "gif", "jxl", "dng", "cr2", "nef", "arw"];
/// Photo folders below a scene, besides all that start with `images`.
const PHOTO_FOLDERS: [&str; 6] = ["images", "input", "photos", "rgb", "frames", "imgs"];

/// Extensions to try for a photo that is listed without one.
pub const PHOTO_EXTENSIONS: [&str; 7] = ["", ".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"];

/// Returns true for the name of a readable photo.
pub fn is_readable(path: &Path) -> bool {
    extension_is_of(path, &READABLE_EXTENSIONS)
}

/// Returns true for the name of a photo of a kind that cannot be read.
pub fn is_unreadable(path: &Path) -> bool {
    extension_is_of(path, &UNREADABLE_EXTENSIONS)
}

fn extension_is_of(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    extensions.iter().any(|known| known.eq_ignore_ascii_case(extension))
}

/// Returns true for the name of a photo folder.
fn is_folder_of_photos(name: &str) -> bool {
    name.starts_with("images") || PHOTO_FOLDERS.contains(&name)
}

/// The entries of a folder, by key.
#[derive(Debug, Default)]
struct Entries {
    by_name: HashMap<String, Vec<PathBuf>>,
    /// Photos, by the key of their name without extension.
    by_stem: HashMap<String, Vec<PathBuf>>,
}

impl Entries {
    fn read(folder: &Path) -> Self {
        let mut found = Self::default();
        // A missing or unreadable folder has no photos.
        for path in read::folder(folder).unwrap_or_default() {
            let Some(name) = path.file_name().and_then(OsStr::to_str) else { continue };
            let stem = path.file_stem().and_then(OsStr::to_str).unwrap_or(name);
            if extension_is_of(&path, &READABLE_EXTENSIONS) || extension_is_of(&path, &UNREADABLE_EXTENSIONS) {
                found.by_stem.entry(folded(stem)).or_default().push(path.clone());
            }
            found.by_name.entry(folded(name)).or_default().push(path);
        }
        found
    }
}

/// Finds the photos of one scene.
#[derive(Debug)]
pub struct PhotoFinder {
    root: PathBuf,
    /// The folder named by the user.
    images: Option<PathBuf>,
    folders: RefCell<HashMap<PathBuf, Entries>>,
    bases: OnceCell<Vec<PathBuf>>,
    /// The photo folder of the scene of which this is one of several models.
    above: OnceCell<Option<PathBuf>>,
    /// Number of photos not found at their listed paths, and the first of them with its file.
    elsewhere: RefCell<Option<(usize, PathBuf, PathBuf)>>,
}

impl PhotoFinder {
    /// Creates a finder for the scene in `root`; `images` replaces all folders.
    pub fn new(root: &Path, images: Option<PathBuf>) -> Self {
        Self {
            root: root.to_owned(),
            images,
            folders: RefCell::default(),
            bases: OnceCell::new(),
            above: OnceCell::new(),
            elsewhere: RefCell::default(),
        }
    }

    /// Returns the photo folder: the one that the user named, or `usual` below the scene.
    pub fn folder(&self, usual: &str) -> PathBuf {
        let below = || if usual == "." { self.root.clone() } else { self.root.join(usual) };
        self.images.clone().unwrap_or_else(below)
    }

    /// Finds the photo listed as `relative`: at this path below one of the scene's `folders`, with any extension if it
    /// is listed without one, or elsewhere.
    pub fn find(&self, folders: &[&str], relative: &Path) -> Option<PathBuf> {
        let given = self.images.as_deref();
        let bases: Vec<PathBuf> = match given {
            Some(images) => vec![images.to_owned()],
            None => folders.iter().map(|folder| self.folder(folder)).chain(self.above()).collect(),
        };
        let paths = trimmed(relative, given.is_some());
        let listed = if given.is_some() { paths.as_slice() } else { &paths[..1] };
        let exact = bases.iter().flat_map(|base| listed.iter().map(move |path| base.join(path)));
        if let Some(found) = exact.clone().find_map(|path| with_any(&path)) {
            return Some(found);
        }
        // A photo missing among others is missing, even if a folder of smaller copies contains it.
        let has_others = bases[0].join(relative).parent().is_some_and(|folder| self.has_photos(folder));
        let bases = if given.is_some() || has_others { bases } else { self.bases() };
        let found = bases.iter().find_map(|base| paths.iter().find_map(|path| self.alike(base, path)))?;
        let mut elsewhere = self.elsewhere.borrow_mut();
        match &mut *elsewhere {
            Some((count, ..)) => *count += 1,
            None => *elsewhere = Some((1, relative.to_owned(), found.clone())),
        }
        Some(found)
    }

    /// Returns the photo folder of the scene, if this is one of its models, such as `sparse/1`.
    fn above(&self) -> Option<PathBuf> {
        let look = || {
            let root = std::path::absolute(&self.root).ok()?;
            let is_scene = |above: &&Path| above.join("sparse").is_dir() && root.starts_with(above.join("sparse"));
            let scene = root.ancestors().skip(1).take(3).find(is_scene)?;
            Some(scene.join("images")).filter(|images| images.is_dir())
        };
        self.above.get_or_init(look).clone()
    }

    /// Returns a note on the photos that were found elsewhere.
    pub fn note(&self) -> Option<String> {
        let elsewhere = self.elsewhere.borrow();
        let (count, listed, found) = elsewhere.as_ref()?;
        Some(format!(
            "{} not at the listed path but found by name: {} is {}",
            counted(count, "photo"),
            listed.display(),
            found.strip_prefix(&self.root).unwrap_or(found).display()
        ))
    }

    /// Describes where photos were looked for and what is below the scene, for messages.
    pub fn hint(&self) -> String {
        if let Some(images) = &self.images {
            let count = count_photos(images);
            return format!("the named folder {} holds {count} PNG or JPEG files", images.display());
        }
        let counts = self.counts();
        if counts.is_empty() {
            return format!(
                "no folder of the scene holds PNG or JPEG files: name the folder of the photos with {}",
                Setting("images")
            );
        }
        let list: Vec<String> =
            counts.iter().take(3).map(|(count, path)| format!("{} ({count})", path.display())).collect();
        format!(
            "PNG and JPEG files are in {}; name the folder of the photos with {}",
            list.join(", "),
            Setting("images")
        )
    }

    /// Returns the folder of the scene with the most photos, and their number.
    pub fn most_photos(&self) -> Option<(PathBuf, usize)> {
        self.counts().into_iter().next().map(|(count, folder)| (folder, count))
    }

    /// Returns the numbers of photos in the scene's folder and its subfolders, the largest first.
    fn counts(&self) -> Vec<(usize, PathBuf)> {
        let below = read::folder(&self.root).unwrap_or_default().into_iter().filter(|path| path.is_dir());
        let folders = std::iter::once(self.root.clone()).chain(below);
        let mut counts: Vec<(usize, PathBuf)> =
            folders.map(|path| (count_photos(&path), path)).filter(|&(count, _)| count > 0).collect();
        counts.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
        counts
    }

    /// Returns the folders that may contain the photos: photo folders, full-size ones first, then the scene's own.
    fn bases(&self) -> Vec<PathBuf> {
        let look = || {
            let entries = read::folder(&self.root).unwrap_or_default();
            let folders = entries.iter().filter(|path| path.is_dir());
            let names = folders.filter_map(|path| path.file_name()?.to_str());
            let mut found: Vec<&str> = names.filter(|name| is_folder_of_photos(name)).collect();
            let rank =
                |name: &str| PHOTO_FOLDERS.iter().position(|known| *known == name).unwrap_or(PHOTO_FOLDERS.len());
            found.sort_by_key(|&name| (rank(name), name.len(), name));
            found.into_iter().map(|name| self.root.join(name)).chain([self.root.clone()]).collect()
        };
        self.bases.get_or_init(look).clone()
    }

    fn has_photos(&self, folder: &Path) -> bool {
        let mut folders = self.folders.borrow_mut();
        !folders.entry(folder.to_owned()).or_insert_with(|| Entries::read(folder)).by_stem.is_empty()
    }

    /// Finds the only file below `base` whose path matches, or whose name matches except for its extension.
    fn alike(&self, base: &Path, relative: &Path) -> Option<PathBuf> {
        let mut folder = base.to_owned();
        let parts: Vec<&str> = relative.iter().map(OsStr::to_str).collect::<Option<_>>()?;
        let (name, above) = parts.split_last()?;
        for part in above {
            folder = match folder.join(part) {
                same if same.is_dir() => same,
                _ => self.only(&folder, |entries| entries.by_name.get(&folded(part)), Path::is_dir)?,
            };
        }
        let key = folded(name);
        if let Some(found) = self.only(&folder, |entries| entries.by_name.get(&key), Path::is_file) {
            return Some(found);
        }
        let has_extension = extension_is_of(Path::new(name), &READABLE_EXTENSIONS)
            || extension_is_of(Path::new(name), &UNREADABLE_EXTENSIONS);
        let stem = if has_extension { Path::new(name).file_stem()?.to_str()? } else { name };
        let stem = folded(stem);
        let readable =
            self.only(&folder, |entries| entries.by_stem.get(&stem), |path| path.is_file() && is_readable(path));
        readable.or_else(|| self.only(&folder, |entries| entries.by_stem.get(&stem), Path::is_file))
    }

    /// Returns the only match in a folder that `is_wanted`.
    fn only(
        &self,
        folder: &Path,
        matches: impl Fn(&Entries) -> Option<&Vec<PathBuf>>,
        is_wanted: impl Fn(&Path) -> bool,
    ) -> Option<PathBuf> {
        let mut folders = self.folders.borrow_mut();
        let entries = folders.entry(folder.to_owned()).or_insert_with(|| Entries::read(folder));
        let mut found = matches(entries)?.iter().filter(|path| is_wanted(path));
        let first = found.next()?;
        found.next().is_none().then(|| first.clone())
    }
}

/// Returns the path, then without its leading photo folders; with `any`, then its name alone.
fn trimmed(relative: &Path, any: bool) -> Vec<PathBuf> {
    let parts: Vec<&OsStr> = relative.iter().filter(|part| *part != "." && *part != "/").collect();
    let leading = parts.iter().take_while(|part| part.to_str().is_some_and(is_folder_of_photos)).count();
    let mut starts = vec![0];
    starts.extend(1..=leading);
    if any {
        starts.extend(parts.len().checked_sub(1));
    }
    starts.dedup();
    let rest = |&start: &usize| parts[start.min(parts.len().saturating_sub(1))..].iter().collect::<PathBuf>();
    let mut paths: Vec<PathBuf> = starts.iter().map(rest).collect();
    // The first is the unchanged path, which may be absolute.
    paths[0] = relative.to_owned();
    paths.dedup();
    paths
}

/// Returns the file at a path, trying all extensions if it has none.
fn with_any(path: &Path) -> Option<PathBuf> {
    PHOTO_EXTENSIONS.iter().find_map(|extension| {
        let mut candidate = path.as_os_str().to_owned();
        candidate.push(extension);
        let candidate = PathBuf::from(candidate);
        candidate.is_file().then_some(candidate)
    })
}

/// Returns the number of readable photos in a folder.
pub fn count_photos(folder: &Path) -> usize {
    read::folder(folder).unwrap_or_default().iter().filter(|path| is_readable(path) && path.is_file()).count()
}
