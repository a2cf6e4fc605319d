//! Scenes: posed photos with masks, as reconstructions and data sets store them.
//!
//! [`open`] reads a scene: a reader (COLMAP, transforms.json, LLFF, Metashape) lists photos and poses. A `photo_recipe`
//! defines how a photo becomes a view ([`lens`], [`window`], size). Photos that do not fit into memory stay in files
//! (`photo_store`). [`reconstruction`] makes a scene of photos without poses. [`capture`] finds problems of photos and
//! poses, and [`initial_gaussians`] creates the first Gaussians.
//!
//! To add a reader, add a file beside `llff` that returns a `Listing`, and a case in `list`.

pub mod array_store;
mod bad_photos;
pub mod camera_json;
pub mod camera_path;
pub mod capture;
pub mod colmap;
pub mod depth;
mod frame_check;
pub mod frames;
pub mod init;
pub mod lens;
mod list;
mod listed_path;
mod listing;
mod llff;
mod load;
mod lookup;
mod mask_notes;
pub mod matte;
mod metashape;
mod missing;
mod outlier_poses;
mod photo_finder;
mod photo_recipe;
mod photo_store;
pub mod points;
mod pose_convention;
mod read_options;
pub mod reconstruction;
pub mod resample;
mod split;
mod transforms;
pub mod truth;
pub mod window;

use labelgs_files::scratch;
use labelgs_scene::stage::Stage;
use labelgs_scene::words::counted;
use labelgs_scene::{Dataset, Error, Result, Setting};
use list::{folder_of, list};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use camera_json::{read_camera, write_cameras};
pub use depth::DepthFolder;
pub use frames::{Frame, Frames};
pub use init::initial_gaussians;
pub use lookup::Lookup;
pub use pose_convention::PoseConvention;
pub use read_options::ReadOptions;

/// Options for reading a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Folder of id masks; `None` reads no masks.
    pub masks: Option<PathBuf>,
    /// Folder of ignore masks: pixels above 0 are excluded from the loss, from votes and from scores. A photo without
    /// such a mask counts completely.
    pub ignore: Option<PathBuf>,
    /// Limit on the longest side of photos, px.
    pub max_resolution: Option<u32>,
    /// Every N-th view by name is held out, starting with the first; `None` holds out nothing. A scene's own split
    /// takes precedence unless this is `None`.
    pub test_every: Option<u32>,
    /// Colour behind transparent photos, R, G, B, 0 to 1.
    pub background: [f32; 3],
    /// Keeps the opacity of transparent training photos, over black, instead.
    pub keep_opacity: bool,
    /// Isolates the objects of the masks in photos: see [`matte`]. Photos without an object are omitted.
    pub masked_only: bool,
    /// Crops training photos to their objects.
    pub cut: bool,
    /// Decodes the photos. Their sizes are read in any case.
    pub photos: bool,
    /// Largest share of undecodable photos, 0 to 1. They are skipped with a note.
    pub max_bad_photos: f32,
    /// Where the scene's files are and how its poses are meant, if the scene itself is wrong about it.
    pub lookup: Lookup,
    /// Undistorts photos to pinhole views. Without it, a view has the pixels of the stored photo, whatever its lens,
    /// and its camera is only correct for pinholes.
    pub undistort: bool,
    /// Most bytes of memory for photos and masks. In a larger scene, some of them are kept in a temporary file, with
    /// the same bits.
    pub photo_memory: u64,
    /// Names of the views to read among the scene's; `None` reads all. The split is computed over all views.
    pub only: Option<Arc<BTreeSet<String>>>,
    /// Folder of the temporary file; with `None` there is no file, and such photos are decoded again each time.
    pub photo_folder: Option<PathBuf>,
}

/// Default memory for photos and masks, bytes.
pub const PHOTO_MEMORY: u64 = 3 << 29;

/// Default for the largest share of undecodable photos.
pub const MAX_BAD_PHOTOS: f32 = 0.1;

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            masks: None,
            ignore: None,
            max_resolution: None,
            test_every: Some(8),
            background: [0.0; 3],
            keep_opacity: false,
            masked_only: false,
            cut: false,
            photos: true,
            max_bad_photos: MAX_BAD_PHOTOS,
            lookup: Lookup::default(),
            undistort: true,
            photo_memory: PHOTO_MEMORY,
            only: None,
            photo_folder: Some(scratch::system_folder()),
        }
    }
}

/// Reads the scene in the folder `scene`: a COLMAP model (in `sparse/0`, `sparse`, `colmap/sparse/0` or the folder
/// itself), otherwise `transforms_train.json` with `transforms_test.json` or `transforms_val.json`, otherwise
/// `transforms.json`, otherwise LLFF's `poses_bounds.npy`, otherwise a Metashape `.xml`. A path to one of the last
/// three reads that file.
///
/// Views are undistorted and resized, each with its own pinhole camera; see [`LoadOptions`] and the notes of the
/// result. Pixels outside the photo get alpha 0 and id 0. A polynomial lens keeps its focal lengths and principal
/// point; other lenses keep the scale at the centre of the photo. A lens of 110 degrees or more becomes cube faces,
/// each a view with the face in its name (`00.left.jpg`); the faces of a photo are held out together. Photos without a
/// file are skipped before the split, undecodable ones after it.
pub fn open(scene: &Path, options: &LoadOptions) -> Result<Dataset> {
    if options.max_resolution == Some(0) {
        return Err(Error::usage(Setting("max_resolution"), "0 px leaves no image; expected 1 or more"));
    }
    if !(0.0..=1.0).contains(&options.max_bad_photos) {
        let problem = format!("{} is not a share; expected a number from 0 to 1", options.max_bad_photos);
        return Err(Error::usage(Setting("max_bad_photos"), problem));
    }
    if options.masked_only && options.photos && options.masks.is_none() {
        let problem = format!("needs the masks of the objects: set {} to their folder", Setting("masks"));
        return Err(Error::usage(Setting("masked_only"), problem));
    }
    let stage = Stage::new("reading poses and points", 0);
    let listing = list(scene, &options.lookup)?;
    drop(stage);
    load::load(folder_of(scene), listing, options)
}

/// Like [`open`]; logs a summary and the notes.
pub fn open_logged(scene: &Path, options: &LoadOptions) -> Result<Dataset> {
    let dataset = open(scene, options)?;
    dataset.notes.iter().for_each(|note| tracing::warn!("{note}"));
    let (train, test, points) = (dataset.train.len(), dataset.test.len(), dataset.points.len());
    let (train, test) = (counted(train, "training view"), counted(test, "test view"));
    tracing::info!("scene: {train}, {test}, {}", counted(points, "point"));
    Ok(dataset)
}
