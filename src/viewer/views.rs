//! The views of a scene as a page sees them: cameras, photos, thumbnails, scores.

use crate::error::{Error, Result};
use crate::eval::metrics::{label_iou, psnr};
use crate::files::image::{jpeg_rgb8, png_rgb8};
use crate::files::resize::{bounded_size, shrink_photo};
use crate::render::Render;
use crate::scene::{Camera, Dataset, Overview, Pixels, View};
use crate::scenes::camera_json::CameraFile;
use serde_json::{Value, json};

/// Longest side of a thumbnail, px.
const THUMBNAIL_SIDE_MAX: u32 = 168;
const THUMBNAIL_JPEG_QUALITY: u8 = 80;

/// A view and whether it is held out.
#[derive(Clone, Debug)]
pub(super) struct SceneView {
    pub(super) view: View,
    pub(super) is_test: bool,
}

/// Scores of a view; none without a photo or a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Score {
    pub(super) psnr: Option<f64>,
    pub(super) iou: Option<f64>,
}

/// The views of a scene, sorted by name; may be empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Views {
    pub(super) list: Vec<SceneView>,
}

impl Views {
    /// Takes the views of a scene. Photos and masks are shared with it.
    pub(super) fn new(dataset: &Dataset) -> Self {
        let posed = |is_test| move |view: &View| SceneView { view: view.clone(), is_test };
        let mut list: Vec<SceneView> = dataset.train.iter().map(posed(false)).collect();
        list.extend(dataset.test.iter().map(posed(true)));
        list.sort_by(|a, b| a.view.name.cmp(&b.view.name));
        Self { list }
    }

    pub(super) fn get(&self, index: usize) -> Result<&SceneView> {
        let missing = || Error::usage("view", format!("there is no view {index}; the scene has {}", self.list.len()));
        self.list.get(index).ok_or_else(missing)
    }

    pub(super) fn describe(&self) -> Value {
        let row = |posed: &SceneView| {
            json!({
                "name": posed.view.name,
                "test": posed.is_test,
                "photo": posed.view.photo.is_some(),
                "camera": CameraFile::from(&posed.view.camera),
            })
        };
        self.list.iter().map(row).collect()
    }

    pub(super) fn cameras(&self) -> Vec<&Camera> {
        self.list.iter().map(|posed| &posed.view.camera).collect()
    }

    /// Returns what the cameras look at; none without views.
    pub(super) fn frame(&self) -> Option<Overview> {
        Overview::from_cameras(self.list.iter().map(|posed| &posed.view.camera))
    }

    /// Returns the photo of a view, or its thumbnail, with the type of the file.
    pub(super) fn picture(&self, index: usize, is_small: bool) -> Option<(&'static str, Vec<u8>)> {
        let photo = self.list.get(index)?.view.photo.as_ref()?.get();
        let photo = photo.inspect_err(|error| tracing::warn!("{error}")).ok()?;
        let size = (photo.width, photo.height);
        if !is_small {
            return Some(("image/png", png_rgb8(size, &photo.rgb()).ok()?));
        }
        let small = bounded_size(size, Some(THUMBNAIL_SIDE_MAX));
        let pixels = shrink_photo(&photo, small.0, small.1).rgb();
        Some(("image/jpeg", jpeg_rgb8(small, &pixels, THUMBNAIL_JPEG_QUALITY).ok()?))
    }
}

impl Score {
    /// Scores a render of a view in full size: PSNR, and the mean IoU of the objects of its mask.
    pub(super) fn new(posed: &SceneView, rendered: &Render) -> Result<Self> {
        let photo = posed.view.photo.as_ref().map(Pixels::get).transpose()?;
        // Before the first labels of a training there is nothing to compare.
        let is_labelled = rendered.labels.iter().any(|&id| id != 0);
        let mask = posed.view.mask()?.filter(|mask| is_labelled && mask.ids.len() == rendered.labels.len());
        Ok(Self {
            psnr: photo.map(|photo| psnr(&rendered.rgb, &photo)).filter(|value| value.is_finite()),
            iou: mask.and_then(|mask| label_iou(&rendered.labels, &mask)),
        })
    }
}

pub(super) fn describe_scores(scores: &[Score], step: u32) -> Value {
    let rows: Vec<_> = scores.iter().map(|score| json!([score.psnr, score.iou])).collect();
    json!({ "kind": "scores", "step": step, "rows": rows })
}
