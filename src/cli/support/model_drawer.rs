//! Draws a model: as a whole if it fits into the memory of the device, else in parts.

use crate::Result;
use crate::cli::support::parsers::bytes;
use crate::engine::{Engine, EngineSize, tell_apart};
use crate::formats::ModelRef;
use crate::gpu::Gpu;
use crate::render::large::{GaussianIndex, Painter, fits};
use crate::render::{Parts, Render, RenderOptions, label_map, render};
use crate::scene::{Camera, LabelMap};
use crate::scheduler::SchedulerOptions;
use clap::Args;
use std::sync::Arc;

/// `--memory-limit` of commands that draw.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct MemoryArg {
    /// Limit of device memory, such as 1500M or 2G. For a larger model, only the Gaussians in view are loaded for each
    /// image.
    #[arg(long, value_name = "SIZE", value_parser = bytes, help_heading = "Device")]
    pub memory_limit: Option<u64>,
}

impl MemoryArg {
    pub(crate) fn options(self) -> SchedulerOptions {
        SchedulerOptions { memory_limit: self.memory_limit, ..SchedulerOptions::default() }
    }
}

/// Returns the size in px that images of all these sizes fit into.
pub(crate) fn largest(sizes: impl Iterator<Item = (u32, u32)>) -> (u32, u32) {
    sizes.fold((1, 1), |a, b| (a.0.max(b.0), a.1.max(b.1)))
}

/// A model that is ready to be drawn.
pub(crate) enum Drawer<'a> {
    /// It is on the device.
    Whole(Box<Engine>, Option<u32>),
    /// Parts of the model are loaded for each image.
    Parts(Box<Painter<'a>>),
}

impl<'a> Drawer<'a> {
    /// Makes one for images of these sizes, px.
    pub(crate) fn new(
        gpu: Arc<Gpu>,
        model: ModelRef<'a>,
        sizes: impl Iterator<Item = (u32, u32)>,
        options: SchedulerOptions,
    ) -> Result<Self> {
        let image = largest(sizes);
        if fits(&gpu, model, image, options)? {
            let whole = model.read()?;
            let labels = || whole.labels.iter().flatten().copied();
            if tell_apart(labels()).is_none() {
                let mut engine = Engine::new(gpu, EngineSize::for_model(&whole, std::iter::once(image)), options)?;
                engine.upload_model(&whole)?;
                return Ok(Self::Whole(Box::new(engine), labels().max()));
            }
        }
        Ok(Self::parts(gpu, model, GaussianIndex::new(model, 0.0, |_, _| true)?.0, options))
    }

    /// Makes one that draws the Gaussians of an index in parts.
    pub(crate) fn parts(gpu: Arc<Gpu>, model: ModelRef<'a>, index: GaussianIndex, options: SchedulerOptions) -> Self {
        tracing::info!("the model does not fit on the device: only the Gaussians in view are loaded for each image");
        Self::Parts(Box::new(Painter::new(gpu, model, index, options)))
    }

    /// The largest label, if the model has some.
    pub(crate) fn largest_label(&self) -> Option<u32> {
        match self {
            Self::Whole(_, label) => *label,
            Self::Parts(painter) => painter.labels().and_then(|labels| labels.iter().copied().max()),
        }
    }

    /// Draws an image.
    pub(crate) fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render> {
        match self {
            Self::Whole(engine, _) => render(engine, camera, options),
            Self::Parts(painter) => painter.render(camera, options),
        }
    }

    /// Draws the label of each pixel.
    pub(crate) fn label_map(&mut self, camera: &Camera, near: f32) -> Result<LabelMap> {
        match self {
            Self::Whole(engine, _) => label_map(engine, camera, near),
            Self::Parts(painter) => painter.render(camera, &RenderOptions::new(near, Parts::LABELS))?.label_map(),
        }
    }
}
