//! What is scored: a model that fits into the memory of the device, or one of which each picture takes a part.

use crate::edit::select::extract;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::large::Painter;
use crate::render::{RenderOptions, Rendered, render};
use crate::scene::{Camera, Gaussians};

/// A model to draw pictures of, as a whole or an object of it alone.
pub(crate) trait Subject {
    /// Labels of the Gaussians; main Gaussians are places in this list.
    fn labels(&self) -> Option<&[u32]>;

    /// Draws an object alone from now on, or everything. Returns false if there is no such object.
    fn show(&mut self, only: Option<u32>) -> Result<bool>;

    /// Draws what is shown.
    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Rendered>;
}

/// A model on the device.
pub(crate) struct Whole<'a> {
    pub(crate) engine: &'a mut Engine,
    pub(crate) model: &'a Gaussians,
    /// Least label confidence of Gaussians in objects that are drawn alone, 0 to 1.
    pub(crate) min_confidence: f32,
}

impl Subject for Whole<'_> {
    fn labels(&self) -> Option<&[u32]> {
        self.model.labels.as_deref()
    }

    fn show(&mut self, only: Option<u32>) -> Result<bool> {
        let Some(label) = only else {
            self.engine.upload_model(self.model)?;
            return Ok(true);
        };
        if !self.labels().is_some_and(|labels| labels.contains(&label)) {
            return Ok(false);
        }
        let part = extract(self.model, &[label], self.min_confidence)?;
        if !part.is_empty() {
            self.engine.upload_model(&part)?;
        }
        Ok(!part.is_empty())
    }

    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Rendered> {
        render(self.engine, camera, options)
    }
}

impl Subject for Painter<'_> {
    fn labels(&self) -> Option<&[u32]> {
        Painter::labels(self)
    }

    fn show(&mut self, only: Option<u32>) -> Result<bool> {
        Ok(Painter::show(self, only))
    }

    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Rendered> {
        Painter::render(self, camera, options)
    }
}
