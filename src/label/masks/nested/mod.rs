//! Finds objects from nested masks. A single-image segmenter finds parts, things, and several things as one,
//! differently in each photo. All views together decide what an object is.
//!
//! Masks of different views that own the same Gaussians form a group. `choose` keeps groups that enough views confirm,
//! drops repeated patterns such as tiles, and picks the nested groups that explain the views best.

mod choose;
mod group;
mod pattern;
pub(crate) mod sight;

use super::associate::Segment;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::{RenderOptions, render};
use crate::scene::{Gaussians, LabelMap, View};
use group::Scene;
use sight::ViewSight;

pub use crate::masks::nested::NestedMasks;

/// Default for the fewest views with a mask of an object, if at least as many views have masks.
pub const OBJECT_VIEWS_MIN: usize = 3;

/// An object: the best mask of it in each view that has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Views, and mask indices there.
    pub masks: Vec<Segment>,
}

/// Finds the objects in nested masks, which have the size of their views; `None` for views without masks. Objects that
/// lie on top of others come last. Each has masks in at least `min_views` views, by default [`OBJECT_VIEWS_MIN`].
/// `engine` holds the model; `tick` is called once per view.
pub fn objects(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[(&View, Option<&NestedMasks>)],
    (near, min_views): (f32, Option<usize>),
    tick: &mut dyn FnMut(),
) -> Result<Vec<Object>> {
    let mut sights = Vec::with_capacity(views.len());
    for (view, masks) in views {
        sights.push(match masks {
            Some(masks) => ViewSight::new(&render(engine, &view.camera, &RenderOptions::for_main(near))?.top_id, masks),
            None => ViewSight::default(),
        });
        tick();
    }
    let scene = Scene::new(sights, model.len());
    let with_masks = views.iter().filter(|(_, masks)| masks.is_some()).count();
    let least = min_views.unwrap_or(OBJECT_VIEWS_MIN.min(with_masks));
    // Masks in only one view are numerous, and objects only on request.
    let groups = choose::confirmed(scene.groups(least.min(2)), least);
    let groups = pattern::without_patterns(&scene, groups, &model.means);
    let chosen = choose::objects(&scene, &groups).into_iter();
    Ok(chosen.map(|group| Object { masks: groups[group].best.clone().into_iter().collect() }).collect())
}

/// Paints the masks of objects in a view, with object numbers from 1; later objects lie on top.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::ops::Range;

    /// A scene of Gaussians that all views show in a row, a pixel each, with masks as ranges and how sure they are.
    fn scene(gaussians: usize, views: &[Vec<(Range<usize>, f64)>]) -> Scene {
        let sights = views.iter().map(|masks| {
            let layer = |(number, (range, _)): (usize, &(Range<usize>, f64))| {
                let id = |at: usize| if range.contains(&at) { number as u16 + 1 } else { 0 };
                LabelMap { width: gaussians as u32, height: 1, ids: (0..gaussians).map(id).collect() }
            };
            let nested = NestedMasks {
                layers: masks.iter().enumerate().map(layer).collect(),
                qualities: masks.iter().map(|(_, quality)| *quality).collect(),
            };
            ViewSight::new(&(0..gaussians as i32).collect::<Vec<_>>(), &nested)
        });
        Scene::new(sights.collect(), gaussians)
    }

    /// Returns the Gaussians of the chosen objects, in order.
    fn chosen(scene: &Scene, views: usize) -> Vec<Range<u32>> {
        let groups = choose::confirmed(scene.groups(views.min(2)), views);
        let range = |at: usize| groups[at].rows[0]..groups[at].rows[groups[at].rows.len() - 1] + 1;
        choose::objects(scene, &groups).into_iter().map(range).collect()
    }

    #[test]
    fn a_whole_stands_for_its_parts_and_a_sheet_does_not() {
        // An object of 20 with two parts of 6 found everywhere; and a sheet below, and another object, with lower
        // scores.
        let view = vec![(10..30, 0.5), (10..16, 0.45), (20..26, 0.45), (0..60, 0.15), (40..55, 0.6)];
        let scene = scene(80, &vec![view; 4]);
        assert_eq!(chosen(&scene, 4), vec![10..30, 40..55]);
    }

    #[test]
    fn what_other_views_do_not_confirm_is_no_object() {
        let [both, one] = [vec![(0..10, 0.6), (30..40, 0.9)], vec![(0..10, 0.6)]];
        let scene = scene(50, &[one.clone(), both, one.clone(), one.clone(), one]);
        assert_eq!(chosen(&scene, 3), vec![0..10]);
    }

    #[test]
    fn an_object_needs_as_many_views_as_are_asked_for() {
        let [all, one] = [vec![(0..10, 0.6), (20..30, 0.7), (40..45, 0.8)], vec![(0..10, 0.6)]];
        let two = all[..2].to_vec();
        // Two views see the object at 20 and one view the object at 40; the others show nothing there.
        let mut scene = scene(50, &[all, two, one]);
        let hide = |sight: &mut ViewSight, from: u32| sight.seen.retain(|&(row, _)| row < from);
        hide(&mut scene.sights[1], 40);
        hide(&mut scene.sights[2], 20);
        assert_eq!(chosen(&scene, 3), vec![0..10]);
        assert_eq!(chosen(&scene, 2).len(), 2);
        assert_eq!(chosen(&scene, 1).len(), 3);
    }

    #[test]
    fn a_large_part_that_all_views_confirm_is_an_object_beside_the_rest() {
        let view = |part: f64| vec![(10..40, 0.6), (30..40, part)];
        assert_eq!(chosen(&scene(60, &vec![view(0.7); 4]), 4), vec![10..40, 30..40], "it lies on top");
        assert_eq!(chosen(&scene(60, &vec![view(0.4); 4]), 4), vec![10..40], "not sure enough");
    }

    #[test]
    fn a_tight_and_a_loose_mask_of_a_thing_are_one_group() {
        let scene = scene(60, &vec![vec![(10..30, 0.5), (10..34, 0.6)]; 3]);
        assert_eq!(scene.groups(2).len(), 1);
        assert_eq!(chosen(&scene, 3), vec![10..34]);
    }

    #[test]
    fn tiles_of_a_floor_are_no_objects_and_two_mats_on_it_are() {
        // Tiles of 9 Gaussians in a plane, then a cube of 27 on it.
        let floor = |tiles: usize| {
            let mut means: Vec<[f32; 3]> = Vec::new();
            for tile in 0..tiles {
                let (x, y) = ((tile % 4) as f32 * 4.0, (tile / 4) as f32 * 4.0);
                means.extend((0..9).map(|at| [x + (at % 3) as f32, y + (at / 3) as f32, 0.0]));
            }
            means.extend((0..27).map(|at| [4.0 + (at % 3) as f32, (at / 3 % 3) as f32, 1.0 + (at / 9) as f32]));
            let masks = (0..tiles).map(|tile| (tile * 9..tile * 9 + 9, 0.8)).chain([(tiles * 9..tiles * 9 + 27, 0.8)]);
            (scene(means.len(), &vec![masks.collect(); 3]), means)
        };
        let (many, means) = floor(12);
        let groups = pattern::without_patterns(&many, choose::confirmed(many.groups(2), 3), &means);
        assert_eq!(groups.iter().map(|group| group.rows.len()).collect::<Vec<_>>(), [27]);
        let (few, means) = floor(2);
        let groups = pattern::without_patterns(&few, choose::confirmed(few.groups(2), 3), &means);
        assert_eq!(groups.len(), 3);
    }
}
