//! Occluders of the objects in each view: given before the first step, or from the rendered depth of the model at
//! intervals.

use super::StepJob;
use crate::error::Result;
use crate::label::occlusion::{Rule, occluders_by_contour};
use crate::render::{RenderOptions, render};
use crate::train::Occlusion;
use crate::train::context::Context;

/// Finds occluders from the rendered depth of every view with masks.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::train) struct OccluderJob;

impl StepJob<Context> for OccluderJob {
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
        let options = RenderOptions::for_depth(config.near);
        for index in 0..views.len() {
            let Some(mask) = &views[index].mask else { continue };
            let rendered = render(engine, views.camera(index), &options)?;
            let found = occluders_by_contour(&*mask.get()?, &rendered.mean_depth()?, Rule::default());
            views[index].occluders = found;
        }
        Ok(())
    }
}
