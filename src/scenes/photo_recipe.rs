//! Creates the views of a photo from its files: decodes, removes ignored pixels, undistorts, resizes.

use super::LoadOptions;
use super::lens::Lens;
use super::listing::{ListedPhoto, check_camera};
use super::matte::cut_out;
use super::resample::{resample_ids, undistort_photo};
use super::window::Window;
use labelgs_files::image::{check_size, photo_size, read_open_photo, read_photo};
use labelgs_files::resize::{aspect_problem, bounded_size, same_aspect, shrink_photo};
use labelgs_masks::mask::{read_checked, read_ignored};
use labelgs_scene::{Camera, Error, LabelMap, Photo, Result};
use std::path::{Path, PathBuf};

/// The files of a photo, and how its views are made from them.
#[derive(Clone, Debug)]
pub struct PhotoRecipe {
    pub listed: ListedPhoto,
    /// The file that lists the photo, for messages.
    pub source: PathBuf,
    pub mask: Option<PathBuf>,
    pub ignore: Option<PathBuf>,
    /// Decodes the photo.
    pub photos: bool,
    /// Colour behind a transparent photo; `None` keeps its opacity.
    pub background: Option<[f32; 3]>,
    pub max_resolution: Option<u32>,
    pub undistort: bool,
    /// Whether the photo is reduced to the objects of the mask.
    pub masked_only: bool,
    /// Whether it is also cropped to them.
    pub cut: bool,
}

/// Margin of pixels around the objects that a cropped training photo keeps, as a share of its longest side: the windows
/// of the loss reach this far, and errors there must be visible.
const MARGIN_SHARE: f64 = 0.02;
/// Smallest margin, px.
const MARGIN_MIN: u32 = 8;

/// A view with its pixels.
pub struct MadeView {
    pub name: String,
    pub camera: Camera,
    pub photo: Option<Photo>,
    pub mask: Option<LabelMap>,
}

/// All views of a photo.
pub struct MadeViews {
    pub views: Vec<MadeView>,
    /// Number of masks whose size differs from the photo's.
    pub resampled: usize,
}

impl PhotoRecipe {
    /// `source` lists the photo. `[mask, ignore]` are the photo's files.
    pub fn new(
        (listed, source): (ListedPhoto, PathBuf),
        [mask, ignore]: [Option<PathBuf>; 2],
        options: &LoadOptions,
    ) -> Self {
        let LoadOptions { photos, max_resolution, undistort, masked_only, .. } = *options;
        let cut = options.cut && masked_only && listed.test != Some(true);
        let is_solid = !masked_only && (listed.test == Some(true) || !options.keep_opacity);
        let background = is_solid.then_some(options.background);
        Self { listed, source, mask, ignore, photos, background, max_resolution, undistort, masked_only, cut }
    }

    /// Reads the size in the photo's file; `None` without a file.
    pub fn stored(&self) -> Result<Option<(u32, u32)>> {
        self.listed.photo.as_deref().map(stored_size).transpose()
    }

    /// Decodes the photo if photos are requested. `stored` is the size of its file.
    pub fn decode(&self, stored: Option<(u32, u32)>) -> Result<Option<Photo>> {
        let camera = &self.listed.camera;
        // Check the aspect ratio before allocating memory for the pixels; the error is reported later.
        match (&self.listed.photo, stored) {
            (Some(path), Some(size)) if self.photos && same_aspect(size, camera.size()) => {
                let read = |colour| read_photo(path, colour);
                self.background.map_or_else(|| read_open_photo(path), read).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// Creates the view or views of the decoded photo.
    pub fn views(&self, stored: Option<(u32, u32)>, mut photo: Option<Photo>) -> Result<MadeViews> {
        let original = at_size(&self.listed, stored)?;
        let size = original.size();
        let mask = self.mask.as_deref().map(|path| read_checked(path, |found| fits_photo(path, found, size)));
        let mask = mask.transpose()?;
        let is_other = |mask: &LabelMap| usize::from((mask.width, mask.height) != size);
        let mut resampled = mask.as_ref().map_or(0, is_other);
        if let (Some(path), Some(photo)) = (&self.ignore, &mut photo) {
            let ignored = read_ignored(path, |found| fits_photo(path, found, size))?;
            resampled += is_other(&ignored);
            invalidate(photo, &ignored);
        }
        if let (true, Some(photo), Some(mask)) = (self.masked_only, &mut photo, &mask) {
            cut_out(photo, mask);
        }
        let windows = self.windows(&original);
        let (path, place) = match &self.listed.photo {
            Some(photo) => (photo, String::new()),
            None => (&self.source, format!("photo {}", self.listed.name)),
        };
        if windows.is_empty() {
            return Err(Error::data(path, place, NO_WINDOW));
        }
        // A lens with unusual coefficients may have no scale at its axis.
        for window in windows.iter().filter(|window| !window.is_photo()) {
            check_camera(path, &format!("view {}", window.name), &window.camera, &Lens::Pinhole)?;
        }
        let view = |window: Window| {
            let size = self.size_of(&window);
            let made = MadeView {
                camera: window.camera.resized(size.0, size.1),
                photo: photo.as_ref().map(|photo| fitted(photo, &window, size)),
                mask: mask.as_ref().map(|mask| resample_ids(mask, &window, size)),
                name: window.name,
            };
            if self.masked_only { self.isolate_objects(made) } else { made }
        };
        Ok(MadeViews { views: windows.into_iter().map(view).collect(), resampled })
    }

    /// Invalidates a photo without an object, and crops others to their objects.
    fn isolate_objects(&self, made: MadeView) -> MadeView {
        let found = made.mask.as_ref().and_then(LabelMap::bounds);
        let Some([left, top, right, bottom]) = found else {
            let blank = |photo: Photo| Photo { rgba: vec![[0; 4]; photo.rgba.len()], ..photo };
            return MadeView { photo: made.photo.map(blank), ..made };
        };
        if !self.cut {
            return made;
        }
        let (width, height) = made.camera.size();
        let margin = ((MARGIN_SHARE * f64::from(width.max(height))).ceil() as u32).max(MARGIN_MIN);
        let (left, top) = (left.saturating_sub(margin), top.saturating_sub(margin));
        let size = ((right + margin).min(width) - left, (bottom + margin).min(height) - top);
        let part = |at: usize| {
            let first = (top as usize + at) * width as usize + left as usize;
            first..first + size.0 as usize
        };
        let rows = || (0..size.1 as usize).map(part);
        MadeView {
            camera: made.camera.cut((left, top), size),
            photo: made.photo.map(|photo| Photo {
                width: size.0,
                height: size.1,
                rgba: rows().flat_map(|row| &photo.rgba[row]).copied().collect(),
            }),
            mask: made.mask.map(|mask| LabelMap {
                width: size.0,
                height: size.1,
                ids: rows().flat_map(|row| &mask.ids[row]).copied().collect(),
            }),
            ..made
        }
    }

    /// Returns the number of pixels of all views.
    pub fn pixels(&self, stored: Option<(u32, u32)>) -> u64 {
        // The error is reported when the views are made.
        let Ok(original) = at_size(&self.listed, stored) else { return 0 };
        let sizes = self.windows(&original).into_iter().map(|window| self.size_of(&window));
        sizes.map(|(width, height)| u64::from(width) * u64::from(height)).sum()
    }

    fn windows(&self, original: &Camera) -> Vec<Window> {
        match self.undistort {
            true => Window::all(&self.listed.name, original, &self.listed.lens),
            false => vec![Window::stored(&self.listed.name, original)],
        }
    }

    fn size_of(&self, window: &Window) -> (u32, u32) {
        bounded_size(window.camera.size(), self.max_resolution)
    }
}

/// Invalidates the pixels where `ignored`, of any scale, is not 0.
fn invalidate(photo: &mut Photo, ignored: &LabelMap) {
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

const NO_WINDOW: &str = "the lens of its camera covers nothing of the photo; check focal lengths and coefficients";

/// Returns the camera at the size of the photo's file, which may be a scaled version of the size in the data set.
pub fn at_photo_size(listed: &ListedPhoto) -> Result<Camera> {
    at_size(listed, listed.photo.as_deref().map(stored_size).transpose()?)
}

fn stored_size(path: &Path) -> Result<(u32, u32)> {
    let size = photo_size(path)?;
    check_size(path, size)?;
    Ok(size)
}

fn at_size(listed: &ListedPhoto, stored: Option<(u32, u32)>) -> Result<Camera> {
    let (Some(path), Some(size)) = (&listed.photo, stored) else { return Ok(listed.camera.clone()) };
    let camera = &listed.camera;
    if let Some(problem) = aspect_problem(("the photo", size), ("its camera", camera.size())) {
        let cure = "use the photos that the cameras were made for (an EXIF orientation is ignored, because poses belong to \
                    the stored pixels)";
        return Err(Error::data(path, "", format!("{problem}; {cure}")));
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

fn fits_photo(path: &Path, found: (u32, u32), photo: (u32, u32)) -> Result<()> {
    let problem = aspect_problem(("the mask", found), ("its photo", photo));
    problem.map_or(Ok(()), |problem| Err(Error::data(path, "", problem + "; make masks of the same photos")))
}
