//! Makes the masks of all views agree, through the Gaussians of a model.

use super::associate::{Owners, Segment, associate};
use super::repair::{Naming, Repairs, adopt, mend, name_groups, rename};
use crate::engine::Engine;
use crate::error::Result;
use crate::label::vote::ballot::{Sweep, Voter, sweep};
use crate::label::vote::decide::count;
use crate::render::label_map;
use crate::scene::{Gaussians, LabelMap, Pixels, View};
use std::collections::BTreeMap;

/// Default for the fewest views of an object: an object in only one view may be a segmentation error.
pub const OBJECT_VIEWS_MIN: usize = 2;

/// What the ids of masks mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ids {
    /// The same object in all views, except for errors.
    Shared,
    /// Unrelated between views.
    PerView,
    /// Objects chosen from all views ([`nested`](super::nested)), which already agree.
    Chosen,
}

/// The options of [`agree`].
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    /// Near plane, world units.
    pub near: f32,
    /// What the ids of the masks mean.
    pub ids: Ids,
    /// Fewest views of an object; objects in fewer views are dropped.
    pub min_views: usize,
    /// Makes masks for views without one.
    pub make_missing: bool,
}

/// Returns the masks of the views (`None` without a mask) and the changes. `engine` holds the model and has memory for
/// votes; `tick` is called at most twice per view.
pub fn agree(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[&View],
    how: Agreement,
    tick: &mut dyn FnMut(),
) -> Result<(Vec<Option<LabelMap>>, Repairs)> {
    let mut repairs = Repairs::default();
    if how.ids == Ids::Chosen {
        let own: Vec<Option<Pixels<LabelMap>>> = views.iter().map(|view| view.mask.clone()).collect();
        let masks = settle(engine, model, views, &own, how, (&mut repairs, tick))?;
        return Ok((masks, repairs));
    }
    let counting = Sweep::new(how.near, 0);
    let mut owners = Vec::with_capacity(views.len());
    for view in views {
        owners.push(match &view.mask {
            Some(mask) => Owners::new(&sweep(engine, &[Voter::for_view(view, mask)], counting)?),
            None => Owners::default(),
        });
        tick();
    }
    let mut groups = associate(&owners);
    groups.retain(|group| group.len() >= how.min_views);
    let naming = if how.ids == Ids::PerView { Naming::Fresh } else { Naming::Majority };
    let areas = areas(views)?;
    let names = name_groups(&groups, &areas, naming);
    let renamed: Vec<Option<Pixels<LabelMap>>> = (views.iter().enumerate())
        .map(|(index, view)| Ok(view.mask()?.map(|mask| rename(index, &mask, &names).into())))
        .collect::<Result<_>>()?;
    let masks = settle(engine, model, views, &renamed, how, (&mut repairs, tick))?;
    repairs.trace(&names, areas.into_keys());
    Ok((masks, repairs))
}

/// Repairs masks whose ids agree: all masks together label the model, and its labels then split masks that cover
/// several objects and add missing ones. `tick` is called once per view.
fn settle(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[&View],
    masks: &[Option<Pixels<LabelMap>>],
    how: Agreement,
    (repairs, tick): (&mut Repairs, &mut dyn FnMut()),
) -> Result<Vec<Option<LabelMap>>> {
    let counting = Sweep::new(how.near, 0);
    // The model's labels, voted by all masks, decide each mask.
    let voters = views.iter().zip(masks).filter_map(|(view, mask)| Some(Voter::for_view(view, mask.as_ref()?)));
    let decision = count(engine, &voters.collect::<Vec<_>>(), false, &model.means, counting)?;
    engine.set_labels(&decision.labels)?;
    let mut mended = Vec::with_capacity(views.len());
    for (index, (view, mask)) in views.iter().zip(masks).enumerate() {
        let shown = label_map(engine, &view.camera, how.near)?;
        mended.push(match mask {
            Some(mask) => Some(mend(index, &*mask.get()?, &shown, repairs)),
            None if how.make_missing => {
                repairs.made.push(index);
                Some(shown)
            }
            None => None,
        });
        tick();
    }
    Ok(mended)
}

/// Returns the masks of views that did not vote, such as held-out views, with the ids of the model's objects. `before`
/// is the result of [`agree`] with the same engine; view numbers continue after its views. Outlines stay unchanged, so
/// that scores compare the model with the masks and not with itself. `tick` is called once per view.
pub fn follow(
    engine: &mut Engine,
    views: &[&View],
    how: Agreement,
    before: (&[Option<LabelMap>], &mut Repairs),
    tick: &mut dyn FnMut(),
) -> Result<Vec<Option<LabelMap>>> {
    let (trained, repairs) = before;
    let objects = trained.iter().flatten().filter(|_| how.ids == Ids::Shared).flat_map(LabelMap::objects).collect();
    let mut masks = Vec::with_capacity(views.len());
    for (index, view) in (trained.len()..).zip(views) {
        masks.push(match view.mask()? {
            Some(mask) => Some(adopt(index, &mask, &label_map(engine, &view.camera, how.near)?, &objects, repairs)),
            None => None,
        });
        tick();
    }
    Ok(masks)
}

fn areas(views: &[&View]) -> Result<BTreeMap<Segment, u64>> {
    let mut areas = BTreeMap::new();
    for (index, view) in views.iter().enumerate() {
        let mask = view.mask()?;
        let ids = mask.iter().flat_map(|mask| &mask.ids).filter(|id| **id != 0);
        ids.for_each(|&id| *areas.entry((index, id)).or_default() += 1);
    }
    Ok(areas)
}
