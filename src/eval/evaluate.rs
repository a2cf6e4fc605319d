//! Scores a model on posed photos: renders every view, then every object alone.

use super::compared::{PictureObserver, ScoredPicture};
use super::metrics::covered;
use super::protocol::score::Distance;
use super::regions::{RegionScores, TrainingDepths};
use super::scores::{ObjectRender, ObjectTruth, Scores, ViewScores};
use super::subject::Subject;
use super::target::Target;
use crate::error::Result;
use crate::label::occlusion::{Rule, occluders_by_contour};
use crate::label::vote::model::objects_of;
use crate::render::{Parts, Render, RenderOptions};
use crate::scene::{LabelMap, Photo, View};
use std::collections::BTreeMap;

/// The options of the renders.
#[derive(Clone, Copy, Debug)]
pub struct Rendering<'a> {
    /// Options for whole scenes; objects are rendered on black.
    pub options: RenderOptions,
    /// Training views, for scores by region; if empty, these scores are omitted.
    pub train: &'a [View],
    /// The label of a pixel is that of its main Gaussian, as in LabelGS, instead of the one with the largest sum of
    /// weights.
    pub by_main: bool,
    /// A perceptual distance of each view to its photo, such as LPIPS.
    pub lpips: Option<&'a dyn Distance>,
}

impl Rendering<'_> {
    /// Makes options without region scores and LPIPS.
    pub fn new(options: RenderOptions) -> Self {
        Self { options, train: &[], by_main: false, lpips: None }
    }
}

/// Ground truth of objects including their hidden parts.
pub trait AmodalTruth {
    /// Returns the whole outline of an object in a view, row-major, at the size of the view; `None` if unknown.
    fn outline(&self, _id: u32, _view: &View) -> Result<Option<Vec<bool>>> {
        Ok(None)
    }

    /// Returns r, g, b and opacity of an object without occluders in a view, row-major, at the size of the view; `None`
    /// if unknown.
    fn alone(&self, _id: u32, _view: &View) -> Result<Option<Vec<[u8; 4]>>> {
        Ok(None)
    }
}

/// No ground truth beyond the masks.
impl AmodalTruth for () {}

/// Scores a model on `views`, which have photos; scores objects too in views with masks. `watch` receives each picture.
pub fn evaluate(
    subject: &mut dyn Subject,
    views: &[&View],
    how: Rendering,
    wholes: &dyn AmodalTruth,
    watch: &mut dyn PictureObserver,
) -> Result<Scores> {
    subject.show(None)?;
    let witnesses = match how.train {
        [] => None,
        train => Some(TrainingDepths::new(subject, train, how.options)?),
    };
    let (mut scores, mut hidden) = (Vec::new(), Vec::new());
    for view in views {
        let (score, occluded) = score_scene(subject, view, how, witnesses.as_ref(), watch)?;
        scores.push(score);
        hidden.push(occluded);
    }
    let of_object = RenderOptions { background: [0.0; 3], parts: Parts::COLOUR, ..how.options };
    for id in objects_of(views).into_iter().map(u32::from) {
        let is_there = subject.show(Some(&[id]))?;
        for (index, view) in views.iter().enumerate() {
            let rendered = if is_there { Some(subject.render(&view.camera, &of_object)?) } else { None };
            let alone = rendered.as_ref().map(|r| ObjectRender { colour: &r.rgb, alpha: &r.alpha });
            let (whole, picture) = (wholes.outline(id, view)?, wholes.alone(id, view)?);
            let (Target { photo, .. }, mask) = (Target::for_view(view, [0.0; 3])?, view.mask()?);
            let mask = mask.as_deref();
            let unknown = pixels_of(mask, hidden[index].get(&(id as u16)));
            let truth = ObjectTruth {
                photo: &photo,
                mask,
                whole: whole.as_deref(),
                hidden: unknown.as_deref(),
                alone: picture.as_deref(),
            };
            scores[index].add_object(id, alone, truth)?;
            show(watch, id, view, alone, truth, &scores[index])?;
        }
    }
    Ok(Scores::new(views.iter().map(|view| view.name.clone()).zip(scores).collect()))
}

/// Scores the scene in a view. Also returns which objects hide which.
fn score_scene(
    subject: &mut dyn Subject,
    view: &View,
    how: Rendering,
    witnesses: Option<&TrainingDepths>,
    watch: &mut dyn PictureObserver,
) -> Result<(ViewScores, BTreeMap<u16, Vec<u16>>)> {
    let labelled = subject.labels().is_some();
    let parts = Parts { main: how.by_main, labels: labelled && !how.by_main, ..Parts::DEPTH };
    let rendered = subject.render(&view.camera, &RenderOptions { parts, ..how.options })?;
    let map = subject.labels().map(|labels| match how.by_main {
        true => rendered.main_label_map(labels),
        false => rendered.label_map(),
    });
    let map = map.transpose()?;
    let (target, mask) = (Target::for_view(view, how.options.background)?, view.mask()?);
    let (photo, mask) = (&*target.photo, mask.as_deref());
    let mut score = ViewScores::with_colour_photo(&rendered.rgb, (photo, target.coloured()), map.as_ref(), mask)?;
    if let Some(witnesses) = witnesses {
        let seen = witnesses.see(&view.camera, &rendered)?;
        score.regions = Some(RegionScores::new(&rendered.rgb, photo, mask, &seen));
    }
    score.lpips = how.lpips.map(|lpips| distance(lpips, &rendered.rgb, target.coloured())).transpose()?;
    let numbers = vec![("PSNR", Some(score.psnr)), ("SSIM", Some(score.ssim)), ("LPIPS", score.lpips)];
    let numbers = numbers.into_iter().filter(|(_, value)| value.is_some()).collect();
    let (labels, truth) = (map.as_ref(), mask);
    watch.observe(&ScoredPicture { numbers, labels, truth, ..ScoredPicture::new(&view.name, photo, &rendered.rgb) })?;
    Ok((score, hidden_by(mask, &rendered)?))
}

/// Returns the distance of a render to the photo. Invalid photo pixels are replaced by the render's.
fn distance(lpips: &dyn Distance, render: &[[f32; 3]], photo: &Photo) -> Result<f64> {
    let render: Vec<[f32; 3]> = render.iter().map(|colour| colour.map(|value| value.clamp(0.0, 1.0))).collect();
    let truth = |(&[r, g, b, valid], &own): (&[u8; 4], &[f32; 3])| match valid {
        0 => own,
        _ => [r, g, b].map(|byte| f32::from(byte) / 255.0),
    };
    let truth: Vec<[f32; 3]> = photo.rgba.iter().zip(&render).map(truth).collect();
    lpips.distance(&render, &truth, photo.width as usize, photo.height as usize)
}

/// Passes an object of a view to `watch`, if it has ground truth there.
fn show(
    watch: &mut dyn PictureObserver,
    id: u32,
    view: &View,
    render: Option<ObjectRender>,
    truth: ObjectTruth,
    scores: &ViewScores,
) -> Result<()> {
    let (Some(outline), Some(row)) = (truth.outline(id), scores.objects.get(&id)) else { return watch.skip() };
    let pixels = outline.len();
    let black = vec![[0.0; 3]; pixels];
    let (rgb, found) = match render {
        Some(render) => (render.colour, covered(render.alpha)),
        None => (&black[..], vec![false; pixels]),
    };
    watch.observe(&ScoredPicture {
        object: Some(id.to_string()),
        masks: Some((&found, &outline)),
        numbers: vec![("IoU", row.iou_object), ("boundary IoU", row.boundary_iou), ("PSNR", row.object_psnr)],
        ..ScoredPicture::new(&view.name, truth.photo, rgb)
    })
}

/// Returns the number of pictures that [`evaluate`] renders.
#[cfg(feature = "cli")]
pub(crate) fn picture_count(views: &[&View]) -> u64 {
    (views.len() * (1 + objects_of(views).len())) as u64
}

fn hidden_by(mask: Option<&LabelMap>, rendered: &Render) -> Result<BTreeMap<u16, Vec<u16>>> {
    let Some(mask) = mask else { return Ok(BTreeMap::new()) };
    // Leave out few pixels, even if a few others are occluded: a score must not excuse errors.
    let rule = Rule { share: 0.5, unlabelled: false, ..Rule::default() };
    Ok(occluders_by_contour(mask, &rendered.mean_depth()?, rule))
}

/// Returns the pixels at which the mask shows one of `ids`.
fn pixels_of(mask: Option<&LabelMap>, ids: Option<&Vec<u16>>) -> Option<Vec<bool>> {
    let (mask, ids) = (mask?, ids?);
    Some(mask.ids.iter().map(|id| ids.contains(id)).collect())
}
