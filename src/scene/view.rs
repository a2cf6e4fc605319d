//! Posed photos with masks, and the scene that they form.

use super::spread::Spread;
use super::{Camera, LabelMap, Pixels};
use crate::error::{Error, Result};
use crate::words::unique;
use glam::DVec3;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// A matrix from the scene's colours (r, g, b) to a photo's: its exposure and white balance.
pub type ColourMatrix = [[f32; 3]; 3];

/// A decoded photo, row-major RGBA8. Alpha is 255 for valid pixels, and 0 for pixels outside the original image after
/// undistortion. Pixels with alpha 0 count in no loss or score.
///
/// A transparent photo without a given background has its colours over black. Its alpha then also encodes the opacity
/// o: 128 + 127 o in valid pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// r, g, b and validity, `[height, width]`.
    pub rgba: Vec<[u8; 4]>,
}

/// Alpha of a valid, fully transparent pixel.
pub const ALPHA_CLEAR: u8 = 128;

/// Returns the alpha of a valid pixel with an opacity from 0 to 1.
pub fn alpha_of(opacity: f64) -> u8 {
    ALPHA_CLEAR + (f64::from(u8::MAX - ALPHA_CLEAR) * opacity).round() as u8
}

impl Photo {
    /// Blends the photo over a colour (r, g, b, 0 to 1); `None` if the photo is opaque.
    pub fn over(&self, behind: [f32; 3]) -> Option<Vec<[u8; 4]>> {
        let shows = |alpha: u8| (ALPHA_CLEAR..u8::MAX).contains(&alpha);
        let over = |&[r, g, b, alpha]: &[u8; 4]| {
            if !shows(alpha) {
                return [r, g, b, alpha];
            }
            let through = 255.0 * f32::from(u8::MAX - alpha) / f32::from(u8::MAX - ALPHA_CLEAR);
            let mix = |colour: u8, behind: f32| (f32::from(colour) + through * behind).round() as u8;
            [mix(r, behind[0]), mix(g, behind[1]), mix(b, behind[2]), u8::MAX]
        };
        self.rgba.iter().any(|texel| shows(texel[3])).then(|| self.rgba.iter().map(over).collect())
    }

    /// Returns true if any pixel is valid.
    pub fn has_valid(&self) -> bool {
        self.rgba.iter().any(|texel| texel[3] > 0)
    }

    /// Returns the colours without validity, `[height, width]`.
    pub fn rgb(&self) -> Vec<[u8; 3]> {
        self.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
    }
}

/// A posed photo. Clones share the photo and the mask.
#[derive(Clone, Debug)]
pub struct View {
    /// Name in the data set, such as `00.jpg` or `left/00.jpg`.
    pub name: String,
    /// Camera of the photo in memory (undistorted, resized).
    pub camera: Camera,
    /// The photo; `None` if photos were not requested.
    pub photo: Option<Pixels<Photo>>,
    /// Mask of the visible objects; `None` if masks were not requested or the view has none.
    pub mask: Option<Pixels<LabelMap>>,
}

impl View {
    /// Returns the photo's pixels; a view without a photo is an error.
    pub fn photo(&self) -> Result<Arc<Photo>> {
        self.photo.as_ref().ok_or_else(|| Error::Bug(format!("{} came without its photo", self.name)))?.get()
    }

    /// Returns the mask's pixels; `None` if the view has no mask.
    pub fn mask(&self) -> Result<Option<Arc<LabelMap>>> {
        self.mask.as_ref().map(Pixels::get).transpose()
    }

    /// Returns the name for output files: without extension, path separators replaced by `_`.
    pub fn stem(&self) -> String {
        let path = std::path::Path::new(&self.name).with_extension("");
        path.to_string_lossy().replace(['/', '\\'], "_")
    }
}

/// Returns unique names for output files of several views: [`View::stem`], with a number appended if an earlier view
/// has the same one (`a/1.jpg` and `a_1.png`).
pub fn stems(views: &[&View]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    views.iter().map(|view| unique(view.stem(), "_", &mut taken)).collect()
}

/// A coloured 3D point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// World position.
    pub position: DVec3,
    /// Colour, r, g, b, sRGB bytes.
    pub colour: [u8; 3],
}

/// A problem found while reading a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneProblem {
    /// Photos were omitted: missing, damaged, or with an outlier pose.
    LeftOut(String),
    /// Many photos in the scene's folder have no pose.
    Unposed(String),
    /// Poses and points do not share a frame.
    Frame(String),
}

impl SceneProblem {
    /// Returns the description.
    pub fn text(&self) -> &str {
        let (Self::LeftOut(text) | Self::Unposed(text) | Self::Frame(text)) = self;
        text
    }
}

/// A scene in memory.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// Folder of the scene.
    pub root: PathBuf,
    /// The file that lists its photos.
    pub source: PathBuf,
    /// Views to train on, sorted by name.
    pub train: Vec<View>,
    /// Held-out views, sorted by name.
    pub test: Vec<View>,
    /// Whether the photos show only the objects of the masks, with the training photos cropped to them.
    pub objects_only: bool,
    /// Initial points; may be empty.
    pub points: Vec<Point>,
    /// Notes for the user about reading, one per line.
    pub notes: Vec<String>,
    /// What was omitted from the scene or does not fit. The notes say so too.
    pub flaws: Vec<SceneProblem>,
}

/// Cameras farther than this many radii of their spread do not count for the extent: a few wrong poses would change
/// learning rates and size limits for the whole scene.
const EXTENT_RADII_MAX: f64 = 5.0;

impl Dataset {
    /// Returns all views, sorted by name.
    pub fn all(&self) -> Vec<&View> {
        let mut views: Vec<&View> = self.train.iter().chain(&self.test).collect();
        views.sort_by(|a, b| a.name.cmp(&b.name));
        views
    }

    /// Returns the radius of the training cameras around their mean, times 1.1 (as in 3DGS), world units; 1 if the
    /// radius is only rounding error. Ignores cameras beyond `EXTENT_RADII_MAX`.
    pub fn extent(&self) -> f64 {
        let all = self.train.iter().map(|view| view.camera.centre());
        let spread = Spread::measure(all.clone());
        let is_usual = |centre: &DVec3| spread.is_none_or(|spread| spread.distance(*centre) <= EXTENT_RADII_MAX);
        let centres: Vec<DVec3> = all.filter(is_usual).collect();
        if centres.is_empty() {
            return 1.0;
        }
        let mean = centres.iter().sum::<DVec3>() / centres.len() as f64;
        let radius = centres.iter().map(|c| c.distance(mean)).fold(0.0, f64::max);
        let far = centres.iter().map(|centre| centre.length()).fold(1.0, f64::max);
        if radius > 1e-9 * far { radius * 1.1 } else { 1.0 }
    }
}
