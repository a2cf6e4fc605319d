//! The scores of a model: per view, per object and on average, for programs and as JSON.
//!
//! Averages over objects are over pairs of view and object, as in the paper's published evaluation.

use super::boundary::boundary_iou;
use super::corrected::psnr_corrected;
use super::crop::Crop;
use super::metrics::{
    Overlap, byte_value, check_means, clamped, covered, mean, paper_score, psnr, psnr_of, scores, square,
};
use super::places::PlaceScore;
use super::regions::RegionScores;
use super::removal::RemovalScores;
use super::specks::specks;
use super::ssim::ssim;
use crate::scene::{LabelMap, Photo};
use crate::{Error, Result, Setting};
use serde::Serialize;
use std::collections::BTreeMap;

/// A view is an outlier if its PSNR is this far below the median, dB. Views of a trained scene usually lie within 3 dB.
const OUTLIER_PSNR_GAP_DB: f64 = 6.0;

scores! {
    /// Scores of one object, in one view or on average over views; `None` if there was nothing to compare.
    ObjectScores {
        /// Intersection over union of the rendered label map and the mask of the view.
        iou_map,
        /// Intersection over union of the object rendered alone (opacity above 0.5) and its whole outline, or its mask
        /// in the view if the outline is unknown.
        iou_object,
        /// Intersection over union by the rule of the paper: any channel above 0.01 against the mask of the view.
        paper_iou,
        /// PSNR of the object alone on black against photo times mask, by the rule of the paper, dB.
        object_psnr,
        /// Boundary IoU of the rendered label map and the mask of the view.
        boundary_iou,
        /// SSIM of the object alone on black against photo times mask, over the `Crop` around its mask, without the
        /// pixels of occluders.
        object_ssim,
        /// Intersection over union of the object alone (opacity above 0.5) and its whole outline, over the pixels where
        /// the mask of the view shows another object.
        iou_hidden,
        /// PSNR of the object alone on black against its ground truth without occluders, over the pixels of its whole
        /// outline where the mask of the view does not show it, dB.
        psnr_hidden,
    }
}

/// Scores of one view.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ViewScores {
    /// PSNR of the clamped render over the photo's valid pixels, dB.
    pub psnr: f64,
    /// The same after the best affine map of the render's colours to the photo's, dB.
    pub psnr_corrected: f64,
    /// SSIM over the photo's valid pixels.
    pub ssim: f64,
    /// LPIPS of the clamped render, if weights are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lpips: Option<f64>,
    /// PSNR by region, if the training views are known.
    #[serde(flatten)]
    pub regions: Option<RegionScores>,
    /// Specks in the label map that the mask does not have; `None` without label map or mask.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specks: Option<u64>,
    /// Scores of the objects by id.
    pub objects: BTreeMap<u32, ObjectScores>,
}

/// An object rendered alone on black.
#[derive(Clone, Copy, Debug)]
pub struct ObjectRender<'a> {
    /// r, g, b per pixel, not clamped, row-major.
    pub colour: &'a [[f32; 3]],
    /// Opacity per pixel, row-major, 0 to 1.
    pub alpha: &'a [f32],
}

/// The ground truth of an object in a view.
#[derive(Clone, Copy, Debug)]
pub struct ObjectTruth<'a> {
    /// The photo.
    pub photo: &'a Photo,
    /// Mask of the view.
    pub mask: Option<&'a LabelMap>,
    /// Whole outline of the object, if known.
    pub whole: Option<&'a [bool]>,
    /// Pixels of objects in front of this one. They are excluded if the whole outline is unknown.
    pub hidden: Option<&'a [bool]>,
    /// r, g, b and opacity of the object without occluders, if known.
    pub alone: Option<&'a [[u8; 4]]>,
}

impl ObjectTruth<'_> {
    /// Returns the pixels of the object in the mask; `None` without any.
    fn visible(&self, id: u32) -> Option<Vec<bool>> {
        let visible: Vec<bool> = self.mask?.ids.iter().map(|&found| u32::from(found) == id).collect();
        visible.contains(&true).then_some(visible)
    }

    /// Returns the pixels to compare the object with: its whole outline, else its visible pixels.
    pub fn outline(&self, id: u32) -> Option<Vec<bool>> {
        let outline = self.whole.map(<[bool]>::to_vec).or_else(|| self.visible(id));
        outline.filter(|outline| outline.contains(&true))
    }

    fn lengths(&self) -> impl Iterator<Item = usize> {
        let lengths = [self.mask.map(|m| m.ids.len()), self.whole.map(<[_]>::len), self.hidden.map(<[_]>::len)];
        lengths.into_iter().chain([self.alone.map(<[_]>::len)]).flatten()
    }
}

impl ViewScores {
    /// Scores a render, and its label map if both it and the mask of the view are given.
    pub fn new(render: &[[f32; 3]], photo: &Photo, map: Option<&LabelMap>, mask: Option<&LabelMap>) -> Result<Self> {
        Self::with_colour_photo(render, (photo, photo), map, mask)
    }

    /// Same as [`Self::new`], with a second photo whose valid pixels count for the colour scores.
    pub(super) fn with_colour_photo(
        render: &[[f32; 3]],
        (photo, coloured): (&Photo, &Photo),
        map: Option<&LabelMap>,
        mask: Option<&LabelMap>,
    ) -> Result<Self> {
        let pixels = photo.rgba.len();
        let lengths = [Some(render.len()), map.map(|map| map.ids.len()), mask.map(|mask| mask.ids.len())];
        if lengths.into_iter().flatten().any(|length| length != pixels) {
            return Err(Error::Bug("render, label map, mask and photo differ in size".into()));
        }
        let mut scores = Self {
            psnr: psnr(render, coloured),
            psnr_corrected: psnr_corrected(render, coloured, |_| true).unwrap_or(f64::NAN),
            ssim: ssim(render, coloured),
            specks: map.zip(mask).map(|(map, mask)| specks(map, mask)),
            ..Self::default()
        };
        let valid = |index: usize| photo.rgba[index][3] > 0;
        for id in mask.into_iter().flat_map(LabelMap::objects) {
            let mut row = ObjectScores::default();
            if let (Some(map), Some(mask)) = (map, mask) {
                let of = |map: &LabelMap| map.ids.iter().map(|&found| found == id).collect::<Vec<bool>>();
                let (found, truth) = (of(map), of(mask));
                row.iou_map = Overlap::over(&found, &truth, valid).iou();
                row.boundary_iou = boundary_iou(&found, &truth, (photo.width as usize, photo.height as usize), valid);
            }
            scores.objects.insert(u32::from(id), row);
        }
        Ok(scores)
    }

    /// Scores object `id` rendered alone. `None` is an empty picture, for a label without Gaussians.
    pub fn add_object(&mut self, id: u32, render: Option<ObjectRender>, truth: ObjectTruth) -> Result<()> {
        let photo = truth.photo;
        let pixels = photo.rgba.len();
        let (black, clear) = (vec![[0.0; 3]; pixels], vec![0.0; pixels]);
        let render = render.unwrap_or(ObjectRender { colour: &black, alpha: &clear });
        if [render.colour.len(), render.alpha.len()].into_iter().chain(truth.lengths()).any(|length| length != pixels) {
            return Err(Error::Bug(format!("pictures of object {id} differ in size from the photo")));
        }
        let Some(outline) = truth.outline(id) else { return Ok(()) };
        let visible = truth.visible(id);
        let scores = self.objects.entry(id).or_default();
        let unknown = |index: usize| truth.whole.is_none() && truth.hidden.is_some_and(|hidden| hidden[index]);
        let covered = covered(render.alpha);
        let overlap = |counts: &dyn Fn(usize) -> bool| {
            Overlap::over(&covered, &outline, |index| photo.rgba[index][3] > 0 && counts(index)).iou()
        };
        scores.iou_object = overlap(&|index| !unknown(index));
        if let (Some(_), Some(mask)) = (truth.whole, truth.mask) {
            let seen = |index: usize| u32::from(mask.ids[index]);
            scores.iou_hidden = overlap(&|index| seen(index) != 0 && seen(index) != id);
            let behind = |index: &usize| outline[*index] && seen(*index) != id && photo.rgba[*index][3] > 0;
            scores.psnr_hidden =
                truth.alone.and_then(|alone| psnr_alone(render.colour, alone, (0..pixels).filter(behind)));
        }
        if let Some(visible) = visible {
            let paper = paper_score(render.colour, photo, &visible);
            (scores.paper_iou, scores.object_psnr) = (paper.iou, Some(paper.psnr));
            let left_out = |index: usize| unknown(index) || (outline[index] && !visible[index]);
            scores.object_ssim = ssim_around(render.colour, photo, &visible, left_out);
        }
        Ok(())
    }
}

/// Returns the PSNR of a clamped render on black against colour times opacity over some pixels; `None` without pixels.
fn psnr_alone(render: &[[f32; 3]], truth: &[[u8; 4]], pixels: impl Iterator<Item = usize>) -> Option<f64> {
    let square = |index: usize| {
        let [r, g, b, opacity] = truth[index].map(byte_value);
        let truth = [r, g, b].map(|value| value * opacity);
        square(clamped(render[index]), truth)
    };
    mean(pixels.map(square)).map(psnr_of)
}

/// Returns the SSIM of a render against photo times mask in the crop around the mask, without the pixels with
/// `left_out`.
fn ssim_around(render: &[[f32; 3]], photo: &Photo, mask: &[bool], left_out: impl Fn(usize) -> bool) -> Option<f64> {
    let crop = Crop::around(mask, photo.width as usize, photo.height as usize)?;
    let texel = |index: usize| {
        let [r, g, b, valid] = photo.rgba[index];
        let colour = if mask[index] { [r, g, b] } else { [0; 3] };
        [colour[0], colour[1], colour[2], if left_out(index) { 0 } else { valid }]
    };
    let (width, height) = crop.size();
    let indices = || crop.indices(photo.width as usize);
    let truth = Photo { width: width as u32, height: height as u32, rgba: indices().map(texel).collect() };
    let found: Vec<[f32; 3]> = indices().map(|index| render[index]).collect();
    Some(ssim(&found, &truth)).filter(|value| value.is_finite())
}

/// The averages of a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeanScores {
    /// Mean PSNR over views, dB.
    pub psnr: Option<f64>,
    /// Mean PSNR over views after a correction of each view's colours, dB.
    pub psnr_corrected: Option<f64>,
    /// Mean SSIM over views.
    pub ssim: Option<f64>,
    /// Mean LPIPS over views, if weights are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lpips: Option<f64>,
    /// Means over views by region, if the training views are known.
    #[serde(flatten)]
    pub regions: Option<RegionScores>,
    /// Mean number of specks over views with masks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specks: Option<f64>,
    /// Means over pairs of view and object.
    #[serde(flatten)]
    pub objects: ObjectScores,
}

/// Scores of a model on a scene. They serialise to the JSON of `labelgs eval`, with null for values that are not
/// finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Scores {
    /// Version of the layout.
    pub schema_version: u32,
    /// Averages.
    pub mean: MeanScores,
    /// Averages of each object over its views, by id.
    pub objects: BTreeMap<u32, ObjectScores>,
    /// Scores of the views by name.
    pub views: BTreeMap<String, ViewScores>,
    /// True if the poses of the views were refined with the model before scoring.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refined_poses: bool,
    /// Scores of removals, if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub removal: Option<RemovalScores>,
    /// Scores by place, such as by block of a merged model.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub places: BTreeMap<String, PlaceScore>,
}

impl Scores {
    /// Computes the averages from the views.
    pub fn new(views: BTreeMap<String, ViewScores>) -> Self {
        let mut by_object: BTreeMap<u32, Vec<ObjectScores>> = BTreeMap::new();
        for view in views.values() {
            view.objects.iter().for_each(|(&id, &scores)| by_object.entry(id).or_default().push(scores));
        }
        let regions = views.values().filter_map(|view| view.regions.as_ref());
        Self {
            schema_version: 1,
            mean: MeanScores {
                psnr: mean(views.values().map(|view| view.psnr)),
                psnr_corrected: mean(views.values().map(|view| view.psnr_corrected)),
                ssim: mean(views.values().map(|view| view.ssim)),
                lpips: mean(views.values().filter_map(|view| view.lpips)),
                regions: regions.clone().next().map(|_| RegionScores::mean(regions)),
                specks: mean(views.values().filter_map(|view| view.specks).map(|count| count as f64)),
                objects: ObjectScores::mean(by_object.values().flatten()),
            },
            objects: by_object.iter().map(|(&id, scores)| (id, ObjectScores::mean(scores.iter()))).collect(),
            views,
            refined_poses: false,
            removal: None,
            places: BTreeMap::new(),
        }
    }

    /// Warns of a view with a much lower PSNR than the others, and names the most frequent remedy. The usual cause is
    /// Gaussians close to the camera that no training photo shows.
    pub fn warn_of_odd_view(&self, near: f32) {
        if let Some((name, found, median)) = self.odd_view() {
            tracing::warn!(
                "view {name} has {found:.1} dB, far below the median of {median:.1} dB; if it looks foggy, raise {} \
                 (now {near}) to about a tenth of the distance to the scene",
                Setting("near")
            );
        }
    }

    /// Returns the view with the lowest PSNR, its PSNR and the median, dB, if it is an outlier. Something is then in
    /// front of its camera, or its pose or photo is wrong.
    pub fn odd_view(&self) -> Option<(&str, f64, f64)> {
        let mut sorted: Vec<(&str, f64)> = self.views.iter().map(|(name, view)| (name.as_str(), view.psnr)).collect();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (&(name, worst), median) = (sorted.first()?, sorted[sorted.len() / 2].1);
        (worst < median - OUTLIER_PSNR_GAP_DB).then_some((name, worst, median))
    }

    /// Compares the mean PSNR and the mean IoU of the label map with the bounds of `--min-psnr` and `--min-iou`.
    pub fn check(&self, min_psnr: Option<f64>, min_iou: Option<f64>) -> Result<()> {
        check_means([self.mean.psnr, self.mean.objects.iou_map], [min_psnr, min_iou])
    }
}
