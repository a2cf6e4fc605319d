//! Occluders of the objects in each view: given before the first step, or from the rendered depth of the model at
//! intervals.

use super::Between;
use crate::error::Result;
use crate::label::occlusion::{Rule, by_contour};
use crate::render::{RenderOptions, render};
use crate::scene;
use crate::train::Occlusion;
use crate::train::context::Context;
use crate::train::input::step_input::TrainView;
use std::collections::BTreeMap;

/// Sets the occluders by name of the view. Drops ids without pixels in the mask of the view. Returns the names of views with
/// masks that `found` lacks; their objects count as not hidden.
pub(in crate::train) fn set_occluders(
    views: &mut [TrainView],
    found: &BTreeMap<String, scene::Occluders>,
) -> Vec<String> {
    let mut without = Vec::new();
    for view in views.iter_mut().filter(|view| view.mask.is_some()) {
        let shown = |label: &u16| view.objects.binary_search(label).is_ok();
        match found.get(&view.name) {
            Some(lists) => {
                let lists = lists.iter().filter(|(label, _)| shown(label));
                let kept = |by: &Vec<u16>| by.iter().copied().filter(|label| *label == 0 || shown(label)).collect();
                view.occluders = lists.map(|(&label, by)| (label, kept(by))).collect();
            }
            None => without.push(view.name.clone()),
        }
    }
    without
}

/// Returns the occluders by name of the view. Every object of a view has an entry.
pub(in crate::train) fn occluders_of(views: &[TrainView]) -> BTreeMap<String, scene::Occluders> {
    let with_masks = views.iter().filter(|view| view.mask.is_some());
    let lists = with_masks.map(|view| {
        let list = |&label: &u16| (label, view.occluders.get(&label).cloned().unwrap_or_default());
        (view.name.clone(), view.objects.iter().map(list).collect())
    });
    lists.collect()
}

/// Finds the occluders by the rendered depth of every view with masks.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::train) struct Occluders;

impl Between<Context> for Occluders {
    fn is_due(&self, step: u32, context: &Context) -> bool {
        let config = &context.config;
        context.has_labels()
            && config.layer_every() > 0
            && config.occlusion == Occlusion::Rendered
            && config.updates_occluders_at(step)
            && !context.blurs_depth_before(step)
    }

    fn run(&mut self, _step: u32, context: &mut Context) -> Result<()> {
        context.refresh_poses()?;
        let Context { engine, config, views, .. } = context;
        let options = RenderOptions::of_depth(config.near);
        for index in 0..views.len() {
            let Some(mask) = &views[index].mask else { continue };
            let rendered = render(engine, views.camera(index), &options)?;
            let found = by_contour(&*mask.get()?, &rendered.mean_depth()?, Rule::default());
            views[index].occluders = found;
        }
        Ok(())
    }
}
