//! Objects from nested masks: a segmenter of single photos finds parts, things and several things as one, in each photo
//! others. What is an object, all views decide together.
//!
//! Masks of different views that own the same Gaussians are a [group](group); [`choose`] keeps those that enough views confirm,
//! leaves out [patterns](pattern) of sheets, and takes of nested ones those that explain the views best.

mod choose;
mod group;
mod pattern;
mod sight;

use super::associate::Segment;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::{RenderOptions, render};
use crate::scene::{Gaussians, LabelMap, View};
use group::Scene;
use sight::Sight;

pub use crate::masks::nested::NestedMasks;

/// An object: the best mask of it in each view that has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Views and numbers of masks there, from 0.
    pub masks: Vec<Segment>,
}

/// Finds the objects in nested masks of views, of the size of the views; `None` for views without. Those that lie on top of
/// others come last. `engine` holds the model; `tick` is called once per view.
pub fn objects(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[(&View, Option<&NestedMasks>)],
    near: f32,
    tick: &mut dyn FnMut(),
) -> Result<Vec<Object>> {
    let mut sights = Vec::with_capacity(views.len());
    for (view, masks) in views {
        sights.push(match masks {
            Some(masks) => Sight::new(&render(engine, &view.camera, &RenderOptions::of_main(near))?.top_id, masks),
            None => Sight::default(),
        });
        tick();
    }
    let scene = Scene::new(sights, model.len());
    let with_masks = views.iter().filter(|(_, masks)| masks.is_some()).count();
    let groups = pattern::without_patterns(&scene, choose::confirmed(scene.groups(), with_masks), &model.means);
    let chosen = choose::objects(&scene, &groups).into_iter();
    Ok(chosen.map(|group| Object { masks: groups[group].best.clone().into_iter().collect() }).collect())
}

/// Paints the masks of objects in a view, with the numbers of objects from 1; later ones lie on top.
pub fn painted(objects: &[Object], view: usize, masks: &NestedMasks) -> Option<LabelMap> {
    let mut painted = masks.layers.first()?.clone();
    painted.ids.fill(0);
    for (object, id) in objects.iter().zip(1..=u16::MAX) {
        for &(_, mask) in object.masks.iter().filter(|(of, _)| *of == view) {
            for layer in &masks.layers {
                let inside = painted.ids.iter_mut().zip(&layer.ids).filter(|(_, found)| **found == mask + 1);
                inside.for_each(|(to, _)| *to = id);
            }
        }
    }
    Some(painted)
}
