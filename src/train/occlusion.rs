//! Occluders of each view's objects from the model's own depth, looked at anew every so often.

use super::{Occlusion, Trainer};
use crate::error::Result;
use crate::infer::occlusion::{MARGIN, occluders};
use crate::infer::render::render;

impl Trainer {
    /// True before the steps at which the occluders are looked at.
    pub(super) fn refreshes_occluders(&self, step: u32) -> bool {
        let config = &self.config;
        self.engine.room().labels.is_some()
            && config.occlusion == Occlusion::Rendered
            && step >= config.label_from
            && (step - config.label_from).is_multiple_of(config.occlusion_every)
            // Right after an opacity reset there is no depth to speak of.
            && !(step > 1 && config.resets_opacity_at(step - 1))
    }

    /// Renders the depth of every view with masks; nothing may be in flight.
    pub(super) fn refresh_occluders(&mut self) -> Result<()> {
        let degree = self.sh_degree();
        for index in 0..self.views.len() {
            let view = &self.views[index];
            let Some(mask) = &view.mask else { continue };
            let rendered = render(&mut self.engine, &view.camera, self.config.near, self.config.background, degree)?;
            let found = occluders(mask, &rendered.mean_depth(), MARGIN);
            self.views[index].occluders = found;
        }
        Ok(())
    }
}
