//! What is scored: a model that fits into the memory of the device, or one of which each picture takes a part.

use crate::edit::select::extract;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::large::Painter;
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::{Camera, Gaussians, LabelMap};

/// A model to draw pictures of, as a whole or some objects of it alone.
pub trait Subject {
    /// Labels of the Gaussians; main Gaussians are places in this list.
    fn labels(&self) -> Option<&[u32]>;

    /// Draws some objects alone from now on, or everything. Returns false if there are no such objects.
    fn show(&mut self, only: Option<&[u32]>) -> Result<bool>;

    /// Draws what is shown.
    fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render>;

    /// Draws the label of each pixel of everything: the one with the largest sum of weights, or that of the main Gaussian,
    /// as in LabelGS.
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
    /// Least label confidence of Gaussians in objects that are drawn alone, 0 to 1.
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
