//! The renderer of a benchmark.

use super::score::Drawn;
use crate::edit::select::extract;
use crate::engine::Engine;
use crate::error::Result;
use crate::render::{Parts, RenderOptions, label_map, render};
use crate::scene::{Camera, Gaussians, LabelMap};

/// Renders a model with labels.
pub trait Painter {
    /// Renders the label of each pixel of the whole scene.
    fn label_map(&mut self, camera: &Camera) -> Result<LabelMap>;
    /// Renders some labels, or the whole scene for `None`, on black.
    fn draw(&mut self, labels: Option<&[u32]>, camera: &Camera) -> Result<Drawn>;
}

/// A [`Painter`] on a device.
pub struct EnginePainter<'a> {
    engine: &'a mut Engine,
    model: &'a Gaussians,
    near: f32,
    min_confidence: f32,
    by_main: bool,
    /// The labels on the device; `Some(None)` is the whole model.
    there: Option<Option<Vec<u32>>>,
}

impl<'a> EnginePainter<'a> {
    /// Makes a painter. `near` is the near plane, world units. Objects drawn alone leave out Gaussians with less than
    /// `min_confidence`. With `by_main`, the label of a pixel is that of its main Gaussian, as in LabelGS.
    pub fn new(engine: &'a mut Engine, model: &'a Gaussians, near: f32, min_confidence: f32, by_main: bool) -> Self {
        Self { engine, model, near, min_confidence, by_main, there: None }
    }

    fn upload(&mut self, labels: Option<&[u32]>) -> Result<()> {
        let wanted = labels.map(<[u32]>::to_vec);
        if self.there.as_ref() != Some(&wanted) {
            match labels {
                Some(labels) => self.engine.upload_model(&extract(self.model, labels, self.min_confidence)?)?,
                None => self.engine.upload_model(self.model)?,
            }
            self.there = Some(wanted);
        }
        Ok(())
    }
}

impl Painter for EnginePainter<'_> {
    fn label_map(&mut self, camera: &Camera) -> Result<LabelMap> {
        self.upload(None)?;
        match &self.model.labels {
            Some(labels) if self.by_main => {
                render(self.engine, camera, &RenderOptions::of_main(self.near))?.main_label_map(labels)
            }
            _ => label_map(self.engine, camera, self.near),
        }
    }

    fn draw(&mut self, labels: Option<&[u32]>, camera: &Camera) -> Result<Drawn> {
        self.upload(labels)?;
        let rendered = render(self.engine, camera, &RenderOptions::new(self.near, Parts::COLOUR))?;
        Ok(Drawn { rgb: rendered.rgb, alpha: rendered.alpha })
    }
}
