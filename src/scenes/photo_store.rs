//! Keeps photos and masks within a memory budget.
//!
//! If the views of a scene fit into the budget, all of them stay in memory. Otherwise the first ones get half of it.
//! The finished pixels of the others go to a temporary file, and each use costs a read but no decoding. The choice does
//! not affect any bit. The other half of the budget is for images that are being made or used.

use super::LoadOptions;
use super::photo_recipe::{MadeView, PhotoRecipe};
use labelgs_files::scratch::{Scratch, ScratchOffset};
use labelgs_scene::pixels::{PixelBuffer, PixelSource};
use labelgs_scene::{Error, LabelMap, Photo, Pixels, Result, Setting, View};
use std::marker::PhantomData;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Bytes per pixel of a photo in memory: RGBA, and the smaller copy for early steps.
const PHOTO_BYTES: u64 = 8;
/// Bytes per pixel of a mask: ids, and the GPU's layout.
const MASK_BYTES: u64 = 6;
/// Bytes per pixel of a photo while its views are made: the decoder's, RGBA, undistorted, and the mask.
const MAKING_BYTES: u64 = 16;

/// What happens if there is no space for the file.
const WITHOUT_FILE: &str = "photos are decoded again each time, which takes longer";

/// Size of a photo's file, if there is one.
type FileSize = Option<(u32, u32)>;

/// Decides which pixels stay in memory.
#[derive(Debug)]
pub(super) struct PhotoStore {
    /// Whether the views of each photo stay in memory.
    holds: Vec<bool>,
    files: Arc<Files>,
}

/// Where the other pixels are.
#[derive(Debug)]
struct Files {
    /// The temporary file; without it, pixels are made again.
    scratch: Option<Scratch>,
    at_once: usize,
    was_damaged: AtomicBool,
}

impl PhotoStore {
    /// Plans the memory of all photos, whose sizes are known. Training views have precedence over held-out ones.
    pub(super) fn new(recipes: &[Arc<PhotoRecipe>], stored: &[Result<FileSize>], options: &LoadOptions) -> Self {
        let cost = |(recipe, stored): (&Arc<PhotoRecipe>, &Result<FileSize>)| {
            let photo = if recipe.photos && recipe.listed.photo.is_some() { PHOTO_BYTES } else { 0 };
            let mask = if recipe.mask.is_some() { MASK_BYTES } else { 0 };
            if photo + mask == 0 { 0 } else { stored.as_ref().map_or(0, |&size| recipe.pixels(size)) * (photo + mask) }
        };
        let costs: Vec<u64> = recipes.iter().zip(stored).map(cost).collect();
        let test: Vec<bool> = recipes.iter().map(|recipe| recipe.listed.test == Some(true)).collect();
        let holds = held(&costs, &test, options.photo_memory);
        if holds.contains(&false) {
            let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
            tracing::info!(
                "photos and masks take {:.1} GiB, but {} is {:.1} GiB: {} of {} photos stay in memory, the \
                 others {}",
                gib(costs.iter().sum()),
                Setting("photo_memory"),
                gib(options.photo_memory),
                holds.iter().filter(|&&holds| holds).count(),
                holds.len(),
                match &options.photo_folder {
                    Some(folder) => format!("in a temporary file in {}", folder.display()),
                    None => "are decoded again each time".to_owned(),
                }
            );
        }
        let pixels = |size: &Result<FileSize>| size.as_ref().map_or(0, |size| size.map_or(0, area));
        let largest = stored.iter().map(pixels).max().unwrap_or(0) * MAKING_BYTES;
        let at_once = usize::try_from(options.photo_memory / 2 / largest.max(1)).unwrap_or(usize::MAX).max(1);
        let scratch = options.photo_folder.as_deref().map(Scratch::new);
        Self { holds, files: Arc::new(Files { scratch, at_once, was_damaged: false.into() }) }
    }

    /// Returns the number of photos that may be decoded at the same time.
    pub(super) fn at_once(&self) -> usize {
        self.files.at_once
    }

    /// Stores the views of the photo at `index`.
    pub(super) fn keep(
        &self,
        index: usize,
        recipe: &Arc<PhotoRecipe>,
        stored: FileSize,
        made: Vec<MadeView>,
    ) -> Vec<View> {
        let view = |(at, MadeView { name, camera, photo, mask })| {
            let origin = ViewOrigin { recipe: Arc::clone(recipe), stored, view: at };
            let mask = mask.map(|mask| self.pixels(index, mask, origin.clone()));
            View { name, camera, photo: photo.map(|photo| self.pixels(index, photo, origin)), mask }
        };
        made.into_iter().enumerate().map(view).collect()
    }

    fn pixels<T: StoredPixels>(&self, index: usize, picture: T, origin: ViewOrigin) -> Pixels<T> {
        if self.holds[index] {
            return picture.into();
        }
        let (facts, size) = (picture.facts(), picture.size());
        let place = self.files.scratch.as_ref().and_then(|scratch| scratch.put(picture.bytes(), WITHOUT_FILE));
        let files = Arc::clone(&self.files);
        Pixels::from_source(
            Arc::new(EvictedPixels { files, origin, place, size, crc: facts.crc, kind: PhantomData::<T> }),
            facts,
        )
    }
}

fn area((width, height): (u32, u32)) -> u64 {
    u64::from(width) * u64::from(height)
}

/// Returns which photos stay in memory.
fn held(costs: &[u64], test: &[bool], budget: u64) -> Vec<bool> {
    let fits = costs.iter().sum::<u64>() <= budget;
    let mut left = if fits { u64::MAX } else { budget / 2 };
    let mut held = vec![false; costs.len()];
    for wanted in [false, true] {
        for index in (0..costs.len()).filter(|&index| test.get(index) == Some(&wanted)) {
            held[index] = costs[index] <= left;
            // Stop at the first photo that does not fit, so that the resident set is a prefix.
            left = if held[index] { left - costs[index] } else { 0 };
        }
    }
    held
}

/// Pixels that the store can hold: a photo or a mask.
trait StoredPixels: PixelBuffer + std::fmt::Debug + Send + Sync + Sized + 'static {
    /// Returns width and height, px.
    fn size(&self) -> (u32, u32);
    /// Creates an image and lets `fill` write its bytes.
    fn filled(size: (u32, u32), fill: impl FnOnce(&mut [u8]) -> std::io::Result<()>) -> std::io::Result<Self>;
    /// Returns the recipe for only these pixels, and their file.
    fn recipe(all: &PhotoRecipe) -> (PhotoRecipe, PathBuf);
    fn from_view(view: MadeView) -> Option<Self>;
}

impl StoredPixels for Photo {
    fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    fn filled(size: (u32, u32), fill: impl FnOnce(&mut [u8]) -> std::io::Result<()>) -> std::io::Result<Self> {
        let mut rgba = vec![[0_u8; 4]; area(size) as usize];
        fill(rgba.as_flattened_mut())?;
        Ok(Self { width: size.0, height: size.1, rgba })
    }

    fn recipe(all: &PhotoRecipe) -> (PhotoRecipe, PathBuf) {
        // A photo of isolated objects needs their mask.
        let mask = all.mask.clone().filter(|_| all.masked_only);
        (PhotoRecipe { mask, ..all.clone() }, all.listed.photo.clone().unwrap_or_default())
    }

    fn from_view(view: MadeView) -> Option<Self> {
        view.photo
    }
}

impl StoredPixels for LabelMap {
    fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    fn filled(size: (u32, u32), fill: impl FnOnce(&mut [u8]) -> std::io::Result<()>) -> std::io::Result<Self> {
        let mut ids = vec![0_u16; area(size) as usize];
        fill(bytemuck::cast_slice_mut(&mut ids))?;
        Ok(Self { width: size.0, height: size.1, ids })
    }

    fn recipe(all: &PhotoRecipe) -> (PhotoRecipe, PathBuf) {
        (PhotoRecipe { photos: false, ignore: None, ..all.clone() }, all.mask.clone().unwrap_or_default())
    }

    fn from_view(view: MadeView) -> Option<Self> {
        view.mask
    }
}

/// The photo of a view.
#[derive(Clone, Debug)]
struct ViewOrigin {
    recipe: Arc<PhotoRecipe>,
    stored: FileSize,
    /// Index of the view among the photo's views.
    view: usize,
}

/// Pixels that are not in memory.
#[derive(Debug)]
struct EvictedPixels<T> {
    files: Arc<Files>,
    origin: ViewOrigin,
    /// Offset in the temporary file, if the pixels are there.
    place: Option<ScratchOffset>,
    size: (u32, u32),
    crc: u32,
    kind: PhantomData<T>,
}

impl<T: StoredPixels> PixelSource<T> for EvictedPixels<T> {
    fn make(&self) -> Result<Arc<T>> {
        match self.place.and_then(|place| self.read(place)) {
            Some(picture) => Ok(Arc::new(picture)),
            None => self.again().map(Arc::new),
        }
    }

    fn at_once(&self) -> usize {
        self.files.at_once
    }
}

impl<T: StoredPixels> EvictedPixels<T> {
    /// Reads the temporary file. If the disk returns wrong bytes, the pixels are made again.
    fn read(&self, place: ScratchOffset) -> Option<T> {
        let scratch = self.files.scratch.as_ref()?;
        let found = T::filled(self.size, |bytes| scratch.read(place, bytes));
        let problem = match found {
            Ok(picture) if picture.crc() == self.crc => return Some(picture),
            Ok(_) => "has other bytes than were written".to_owned(),
            Err(error) => format!("cannot be read: {error}"),
        };
        if !scratch.has_failed() && !self.files.was_damaged.swap(true, Relaxed) {
            tracing::warn!("the temporary file of photos {problem}; such photos are decoded again");
        }
        None
    }

    /// Makes the pixels from their files again.
    fn again(&self) -> Result<T> {
        let ViewOrigin { recipe, stored, view } = &self.origin;
        let (recipe, path) = T::recipe(recipe);
        let gone = |error| match error {
            Error::Read { path, source } => {
                let problem = format!("{source}; it existed when the scene was opened: restore it and resume");
                Error::Read { path, source: std::io::Error::new(source.kind(), problem) }
            }
            other => other,
        };
        let changed = "has different pixels than when the scene was opened; restore it, or start again";
        let changed = || Error::data(&path, "", changed);
        let photo = recipe.decode(*stored).map_err(gone)?;
        if photo.as_ref().is_some_and(|photo| Some(photo.size()) != *stored) {
            return Err(changed());
        }
        let made = recipe.views(*stored, photo).map_err(gone)?.views.into_iter().nth(*view).and_then(T::from_view);
        made.filter(|made| made.size() == self.size && made.crc() == self.crc).ok_or_else(changed)
    }
}

#[cfg(test)]
mod tests {
    use super::held;

    #[test]
    fn all_stay_or_the_first_ones_to_train_on_get_half() {
        let test = [true, false, false, false, true];
        assert_eq!(held(&[10; 5], &test, 50), [true; 5]);
        assert_eq!(held(&[10; 5], &test, 49), [false, true, true, false, false]);
        assert_eq!(held(&[10; 5], &test, 1), [false; 5]);
        assert_eq!(held(&[1, 0, 0, 0, 1], &test, 1), [false, true, true, true, false]);
    }
}
