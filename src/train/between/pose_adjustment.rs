//! Adjusts the photos' poses by comparing the photos with each other.

use super::StepJob;
use crate::bundle_adjustment::{Frame, PHOTOS_MAX, adjusted};
use crate::error::Result;
use crate::render::{RenderOptions, render};
use crate::train::context::Context;
use crate::train::objective::Parameter;
use crate::train::shared::poses;

/// Settles the poses of all photos that overlap enough with others.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::train) struct PoseAdjustment;

impl StepJob<Context> for PoseAdjustment {
    fn is_due(&self, step: u32, context: &Context) -> bool {
        // With a finished model, poses follow from the model alone.
        context.objective.trains(Parameter::Positions)
            && context.shared.photo_rows(poses::POSES_NAME).is_some()
            && poses::are_compared_before(context.step_context(step))
            && !context.blurs_depth_before(step)
    }

    fn run(&mut self, _step: u32, context: &mut Context) -> Result<()> {
        let Some(range) = context.shared.photo_rows(poses::POSES_NAME) else { return Ok(()) };
        if context.views.len() > PHOTOS_MAX {
            tracing::warn!("with more than {PHOTOS_MAX} photos, poses are refined by the model only");
            return Ok(());
        }
        context.refresh_poses()?;
        let found = adjusted(frames(context)?);
        let mut rows = context.engine.shared()?;
        let mut unknown = Vec::new();
        for (index, found) in found.iter().enumerate() {
            let view = &context.views[index];
            let of_view = &mut rows[context.shared.view_range(index)][range.clone()];
            if found.as_ref().and_then(|found| poses::settle(of_view, &view.camera, found)).is_none() {
                unknown.push(view.name.as_str());
            }
        }
        let (count, all) = (found.len() - unknown.len(), found.len());
        tracing::info!("poses of {count} of {all} photos adjusted by comparing the photos");
        if !unknown.is_empty() {
            tracing::debug!("poses refined by the model only: {}", unknown.join(", "));
        }
        if count > 0 {
            context.engine.set_shared(&rows)?;
            context.refresh_poses()?;
        }
        Ok(())
    }
}

/// Returns the photo of each view with model depths.
fn frames(context: &mut Context) -> Result<Vec<Frame>> {
    let Context { engine, config, views, .. } = context;
    let options = RenderOptions::for_depth(config.near);
    let mut frames = Vec::with_capacity(views.len());
    for (index, view) in views.iter().enumerate() {
        let camera = Frame::camera_of(views.camera(index), views.len());
        let model = render(engine, &camera, &options)?;
        frames.push(Frame::new(camera, &*view.photo.get()?, &model.depth, &model.alpha));
    }
    Ok(frames)
}
