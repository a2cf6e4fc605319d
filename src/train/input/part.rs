//! Parts of photos, one per step: whole photos, or bands of rows if a whole photo has too many tiles for the device.
//!
//! Only steps use parts. Exposure, pose and occluders belong to the whole photo, and jobs between steps use whole
//! photos.

use super::step_input::{self, ObjectLight};
use crate::engine::Band;
use crate::scene::labels::objects_of;
use crate::scene::{Camera, LabelMap, Photo};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The photo part that a step trains on.
#[derive(Debug)]
pub(in crate::train) struct PhotoPart {
    /// Index of the training view.
    pub(in crate::train) view: usize,
    /// Rows of the part.
    pub(in crate::train) band: Band,
    /// Camera of these rows.
    pub(in crate::train) camera: Camera,
    /// Camera of the whole photo, if the part does not have all rows.
    pub(in crate::train) whole: Option<Camera>,
    /// Number of valid pixels of the part.
    pub(in crate::train) valid_pixels: u64,
    /// Ids of the objects in its mask, sorted.
    pub(in crate::train) objects: Vec<u16>,
    /// Light and area of each object, by id.
    pub(in crate::train) shown: BTreeMap<u16, ObjectLight>,
}

impl PhotoPart {
    /// Splits a view into parts of at most `most` rows. `labels` is the mask in device layout.
    pub(in crate::train) fn split(
        (view, camera): (usize, &Camera),
        photo: &Photo,
        mask: Option<&LabelMap>,
        labels: &[u32],
        most: Option<u32>,
    ) -> Vec<Self> {
        let bands = Band::split(camera.height, most.unwrap_or(camera.height));
        let is_whole = bands.len() == 1;
        let of = |band: Band| {
            let pixels = band.pixels(camera.width);
            let rgba = &photo.rgba[pixels.clone()];
            let ids = mask.map_or(&[][..], |mask| &mask.ids[pixels.clone()]);
            let labels = if labels.is_empty() { labels } else { &labels[pixels] };
            Self {
                view,
                band,
                camera: band.camera(camera),
                whole: (!is_whole).then(|| camera.clone()),
                valid_pixels: step_input::valid_pixels(rgba),
                objects: objects_of(ids),
                shown: step_input::shown_objects(rgba, labels),
            }
        };
        bands.into_iter().map(of).collect()
    }
}

/// Returns the band's rows of a photo.
pub(in crate::train) fn photo_of(band: Band, photo: Arc<Photo>) -> Arc<Photo> {
    if band.rows == photo.height {
        return photo;
    }
    let rgba = photo.rgba[band.pixels(photo.width)].to_vec();
    Arc::new(Photo { width: photo.width, height: band.rows, rgba })
}

/// Returns the band's rows of the mask in device layout, which is empty without a mask.
pub(in crate::train) fn labels_of(band: Band, width: u32, labels: Arc<Vec<u32>>) -> Arc<Vec<u32>> {
    let pixels = band.pixels(width);
    if labels.is_empty() || pixels.len() == labels.len() {
        return labels;
    }
    Arc::new(labels[pixels].to_vec())
}
