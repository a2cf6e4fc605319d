//! The scores of a model: per view, per object and on average, as numbers and as JSON.
//!
//! Averages over objects are over pairs of view and object, as in the paper's published evaluation.

use super::metrics::{COVERED, Overlap, mean, paper_score, psnr};
use super::ssim::ssim;
use crate::scene::{LabelMap, Photo};
use crate::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;

/// Scores of one object, in one view or on average over views. `None` where there was nothing to compare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ObjectScores {
    /// Intersection over union of the rendered label map and the mask of the view.
    pub iou_map: Option<f64>,
    /// Intersection over union of the object rendered alone (opacity above 0.5) and its whole outline; without a whole
    /// outline its mask in the view.
    pub iou_object: Option<f64>,
    /// The same by the paper's rule: any channel above 0.01 against the mask of the view.
    pub paper_iou: Option<f64>,
    /// PSNR of the object alone on black against photo times mask, by the paper's rule, dB.
    pub object_psnr: Option<f64>,
}

/// Scores of one view.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ViewScores {
    /// PSNR of the clamped render over the photo's valid pixels, dB.
    pub psnr: f64,
    /// SSIM over the photo's valid pixels.
    pub ssim: f64,
    /// Objects by id.
    pub objects: BTreeMap<u32, ObjectScores>,
}

/// An object rendered alone on black: colour (not clamped) and opacity per pixel.
#[derive(Clone, Copy, Debug)]
pub struct ObjectRender<'a> {
    /// r, g, b per pixel.
    pub colour: &'a [[f32; 3]],
    /// Opacity per pixel.
    pub alpha: &'a [f32],
}

impl ViewScores {
    /// Scores a render, and its label map if both it and the mask of the view are there.
    pub fn new(render: &[[f32; 3]], photo: &Photo, map: Option<&LabelMap>, mask: Option<&LabelMap>) -> Result<Self> {
        let pixels = photo.rgba.len();
        let lengths = [Some(render.len()), map.map(|map| map.ids.len()), mask.map(|mask| mask.ids.len())];
        if lengths.into_iter().flatten().any(|length| length != pixels) {
            return Err(Error::Bug("render, label map, mask and photo differ in size".into()));
        }
        let mut scores = Self { psnr: psnr(render, photo), ssim: ssim(render, photo), objects: BTreeMap::new() };
        if let Some(mask) = mask {
            for id in mask.objects() {
                let iou_map = map.and_then(|map| {
                    let ids = map.ids.iter().zip(&mask.ids).zip(&photo.rgba).filter(|(_, pixel)| pixel[3] > 0);
                    Overlap::count(ids.map(|((&found, &truth), _)| (found == id, truth == id))).iou()
                });
                scores.objects.insert(u32::from(id), ObjectScores { iou_map, ..ObjectScores::default() });
            }
        }
        Ok(scores)
    }

    /// Scores object `id` rendered alone; `None` for a label without Gaussians, which is an empty picture. `whole` is
    /// the object's whole outline, where the scene knows it; without it, `hidden` says which pixels belong to objects in
    /// front of this one, where nobody knows whether it goes on.
    pub fn add_object(
        &mut self,
        id: u32,
        render: Option<ObjectRender>,
        photo: &Photo,
        mask: Option<&LabelMap>,
        whole: Option<&[bool]>,
        hidden: Option<&[bool]>,
    ) -> Result<()> {
        let pixels = photo.rgba.len();
        let (black, clear) = (vec![[0.0; 3]; pixels], vec![0.0; pixels]);
        let render = render.unwrap_or(ObjectRender { colour: &black, alpha: &clear });
        let lengths =
            [Some(render.colour.len()), Some(render.alpha.len()), mask.map(|m| m.ids.len()), whole.map(<[bool]>::len)];
        let lengths = lengths.into_iter().chain([hidden.map(<[bool]>::len)]);
        if lengths.flatten().any(|length| length != pixels) {
            return Err(Error::Bug(format!("pictures of object {id} differ in size from the photo")));
        }
        let visible: Option<Vec<bool>> =
            mask.map(|mask| mask.ids.iter().map(|&found| u32::from(found) == id).collect());
        let visible = visible.filter(|visible| visible.contains(&true));
        let outline = whole.or(visible.as_deref()).filter(|outline| outline.contains(&true));
        let Some(outline) = outline else { return Ok(()) };
        let scores = self.objects.entry(id).or_default();
        let unknown = |index: usize| whole.is_none() && hidden.is_some_and(|hidden| hidden[index]);
        let known = (0..pixels).filter(|&index| photo.rgba[index][3] > 0 && !unknown(index));
        scores.iou_object = Overlap::count(known.map(|index| (render.alpha[index] > COVERED, outline[index]))).iou();
        if let Some(visible) = visible {
            let paper = paper_score(render.colour, photo, &visible);
            (scores.paper_iou, scores.object_psnr) = (paper.iou, Some(paper.psnr));
        }
        Ok(())
    }
}

/// Averages over everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeanScores {
    /// Mean over views of their PSNR, dB.
    pub psnr: Option<f64>,
    /// Mean over views of their SSIM.
    pub ssim: Option<f64>,
    /// Means over pairs of view and object.
    #[serde(flatten)]
    pub objects: ObjectScores,
}

/// Scores of a model on a scene. Serialises to the JSON of `labelgs eval`; what is not finite becomes null.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Scores {
    /// Version of this layout.
    pub schema_version: u32,
    /// Averages.
    pub mean: MeanScores,
    /// Averages of each object over the views that show it.
    pub objects: BTreeMap<u32, ObjectScores>,
    /// Views by name.
    pub views: BTreeMap<String, ViewScores>,
}

impl Scores {
    /// Averages the views.
    pub fn new(views: BTreeMap<String, ViewScores>) -> Self {
        let mut by_object: BTreeMap<u32, Vec<ObjectScores>> = BTreeMap::new();
        for view in views.values() {
            view.objects.iter().for_each(|(&id, &scores)| by_object.entry(id).or_default().push(scores));
        }
        let pairs: Vec<ObjectScores> = by_object.values().flatten().copied().collect();
        Self {
            schema_version: 1,
            mean: MeanScores {
                psnr: mean(views.values().map(|view| view.psnr)),
                ssim: mean(views.values().map(|view| view.ssim)),
                objects: average(&pairs),
            },
            objects: by_object.iter().map(|(&id, scores)| (id, average(scores))).collect(),
            views,
        }
    }

    /// The checks of `--min-psnr` and `--min-iou`: mean PSNR, and mean IoU of the label map.
    pub fn check(&self, min_psnr: Option<f64>, min_iou: Option<f64>) -> Result<()> {
        let rows = [("PSNR", self.mean.psnr, min_psnr, " dB"), ("IoU", self.mean.objects.iou_map, min_iou, "")];
        for (what, found, least, unit) in rows {
            let Some(least) = least else { continue };
            let Some(found) = found else {
                return Err(Error::Check(format!("there is no {what} to compare with {least}{unit}")));
            };
            // A NaN is not enough either.
            if !matches!(found.partial_cmp(&least), Some(std::cmp::Ordering::Greater | std::cmp::Ordering::Equal)) {
                return Err(Error::Check(format!("mean {what} is {found:.4}{unit}, less than {least}{unit}")));
            }
        }
        Ok(())
    }
}

fn average(scores: &[ObjectScores]) -> ObjectScores {
    let over = |field: fn(&ObjectScores) -> Option<f64>| mean(scores.iter().filter_map(field));
    ObjectScores {
        iou_map: over(|scores| scores.iou_map),
        iou_object: over(|scores| scores.iou_object),
        paper_iou: over(|scores| scores.paper_iou),
        object_psnr: over(|scores| scores.object_psnr),
    }
}
