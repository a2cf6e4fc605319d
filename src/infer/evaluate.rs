//! Scores of a model on posed photos: renders every view, then every object alone.

use super::occlusion::{Rule, by_contour};
use super::render::{Rendered, render};
use super::scores::{ObjectRender, Scores, ViewScores};
use super::select::extract;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::scene::{Gaussians, LabelMap, View};
use std::collections::BTreeMap;

/// How views are rendered for scoring.
#[derive(Clone, Copy, Debug)]
pub struct Rendering {
    /// Near plane, world units.
    pub near: f32,
    /// Colour behind the scene; objects are rendered on black.
    pub background: [f32; 3],
}

/// Whole outline of an object in a view, where the scene knows it.
pub type Outline<'a> = dyn Fn(u32, &View) -> Result<Option<Vec<bool>>> + 'a;

/// Scores `model` on `views`, which come with photos; objects where the views have masks. The engine's model is
/// replaced; `tick` is called after each picture.
pub fn evaluate(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[&View],
    how: Rendering,
    outline: &Outline,
    tick: &mut dyn FnMut(),
) -> Result<Scores> {
    engine.upload_model(model)?;
    let labels = model.labels.as_deref();
    let mut scores = Vec::new();
    let mut hidden = Vec::new();
    for view in views {
        let rendered = render(engine, &view.camera, how.near, how.background, model.sh_degree)?;
        let map = labels.map(|labels| rendered.label_map(labels));
        scores.push(ViewScores::new(&rendered.rgb, photo(view)?, map.as_ref(), view.mask.as_ref())?);
        hidden.push(hidden_by(view.mask.as_ref(), &rendered));
        tick();
    }
    for id in objects(views) {
        let part = labels.filter(|labels| labels.contains(&id)).map(|_| extract(model, &[id])).transpose()?;
        if let Some(part) = &part {
            engine.upload_model(part)?;
        }
        for (index, view) in views.iter().enumerate() {
            let rendered = match &part {
                Some(_) => Some(render(engine, &view.camera, how.near, [0.0; 3], model.sh_degree)?),
                None => None,
            };
            let alone = rendered.as_ref().map(|r| ObjectRender { colour: &r.rgb, alpha: &r.alpha });
            let (whole, photo) = (outline(id, view)?, photo(view)?);
            let unknown = pixels_of(view.mask.as_ref(), hidden[index].get(&(id as u16)));
            scores[index].add_object(id, alone, photo, view.mask.as_ref(), whole.as_deref(), unknown.as_deref())?;
            tick();
        }
    }
    Ok(Scores::new(views.iter().map(|view| view.name.clone()).zip(scores).collect()))
}

/// Pictures that [`evaluate`] renders.
pub fn picture_count(views: &[&View]) -> u64 {
    (views.len() * (1 + objects(views).len())) as u64
}

/// Objects of the views' masks, sorted.
fn objects(views: &[&View]) -> Vec<u32> {
    let ids = views.iter().filter_map(|view| view.mask.as_ref()).flat_map(LabelMap::objects).map(u32::from);
    ids.collect::<std::collections::BTreeSet<u32>>().into_iter().collect()
}

fn photo(view: &View) -> Result<&crate::scene::Photo> {
    view.photo.as_ref().ok_or_else(|| Error::Bug(format!("{} came without its photo", view.name)))
}

fn hidden_by(mask: Option<&LabelMap>, rendered: &Rendered) -> BTreeMap<u16, Vec<u16>> {
    mask.map(|mask| by_contour(mask, &rendered.mean_depth(), Rule::default())).unwrap_or_default()
}

/// True where the mask shows one of `ids`.
fn pixels_of(mask: Option<&LabelMap>, ids: Option<&Vec<u16>>) -> Option<Vec<bool>> {
    let (mask, ids) = (mask?, ids?);
    Some(mask.ids.iter().map(|id| ids.contains(id)).collect())
}
