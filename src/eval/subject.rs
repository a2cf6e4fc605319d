//! The model to score: in device memory as a whole, or with a different part loaded for each picture.

use crate::edit::select::extract;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::large::Painter;
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::{Camera, Gaussians, LabelMap};

/// A model that can be drawn as a whole or with some objects alone.
pub trait Subject {
    /// Labels of the Gaussians; main Gaussians are indices into this list.
    fn labels(&self) -> Option<&[u32]>;

    /// Selects what to draw: some objects alone, or everything. Returns false if there are no such objects.
    fn show(&mut self, only: Option<&[u32]>) -> Result<bool>;

    /// Draws the current selection.
    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render>;

    /// Draws the label map of the whole model: per pixel, the label with the largest sum of weights, or that of the
    /// main Gaussian, as in LabelGS.
    fn label_map(&mut self, camera: &Camera, near: f32, by_main: bool) -> Result<LabelMap> {
        if by_main {
            let rendered = self.render(camera, &RenderOptions::for_main(near))?;
            return rendered.main_label_map(self.labels().unwrap_or_default());
        }
        self.render(camera, &RenderOptions { sh_degree: Some(0), ..RenderOptions::new(near, Parts::LABELS) })?
            .label_map()
    }
}

/// A model on the device.
pub struct WholeModel<'a> {
    /// The device.
    pub engine: &'a mut Engine,
    /// The model.
    pub model: &'a Gaussians,
    /// Smallest label confidence of Gaussians in objects drawn alone, 0 to 1.
    pub min_confidence: f32,
}

impl Subject for WholeModel<'_> {
    fn labels(&self) -> Option<&[u32]> {
        self.model.labels.as_deref()
    }

    fn show(&mut self, only: Option<&[u32]>) -> Result<bool> {
        let Some(labels) = only else {
            self.engine.upload_model(self.model)?;
            return Ok(true);
        };
        if !labels.iter().all(|label| self.labels().is_some_and(|own| own.contains(label))) {
            return Ok(false);
        }
        let part = extract(self.model, labels, self.min_confidence)?;
        self.engine.upload_model(&part)?;
        Ok(!part.is_empty())
    }

    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render> {
        render(self.engine, camera, options)
    }
}

impl Subject for Painter<'_> {
    fn labels(&self) -> Option<&[u32]> {
        Painter::labels(self)
    }

    fn show(&mut self, only: Option<&[u32]>) -> Result<bool> {
        Ok(Painter::show(self, only))
    }

    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render> {
        Painter::render(self, camera, options)
    }
}
