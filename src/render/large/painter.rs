//! Draws a large model: loads the Gaussians that a picture may show, and halves the picture until they fit.

use super::GaussianIndex;
use crate::engine::{Band, Engine, EngineSize, LabelSize, tell_apart, uniforms};
use crate::error::{Error, Result};
use crate::formats::ModelRef;
use crate::gpu::Gpu;
use crate::pass::KernelShape;
use crate::render::{Render, RenderOptions, render_band};
use crate::scene::{Camera, Gaussians};
use crate::scheduler::SchedulerOptions;
use std::sync::Arc;

/// Returns true if the device has the memory to draw `count` Gaussians at once in images of up to `image` px.
pub fn fits(gpu: &Gpu, model: ModelRef, image: (u32, u32), options: SchedulerOptions) -> Result<bool> {
    let size = EngineSize::new(model.count().max(1), image).with_labels(labels_of(model));
    Ok(prediction(gpu, size, options)?.is_none())
}

fn labels_of(model: ModelRef) -> Option<LabelSize> {
    model.has_labels().then(LabelSize::default)
}

/// Returns the error if an engine of this size does not fit, or `None` if it fits.
fn prediction(gpu: &Gpu, size: EngineSize, options: SchedulerOptions) -> Result<Option<Error>> {
    match Engine::predict(gpu, &size, options) {
        Ok(_) => Ok(None),
        Err(error @ Error::OutOfMemory { .. }) => Ok(Some(error)),
        Err(other) => Err(other),
    }
}

/// Draws a model, or some of its objects alone.
pub struct Painter<'a> {
    gpu: Arc<Gpu>,
    model: ModelRef<'a>,
    index: GaussianIndex,
    only: Option<Vec<u32>>,
    engine: Option<Engine>,
    shape: KernelShape,
    options: SchedulerOptions,
}

impl<'a> Painter<'a> {
    /// Makes a painter of the Gaussians in an index of `model`.
    pub fn new(gpu: Arc<Gpu>, model: ModelRef<'a>, index: GaussianIndex, options: SchedulerOptions) -> Self {
        let shape = KernelShape::for_device(gpu.capabilities());
        Self { gpu, model, index, only: None, engine: None, shape, options }
    }

    /// Labels of the Gaussians.
    pub(crate) fn labels(&self) -> Option<&[u32]> {
        self.index.labels()
    }

    /// Draws some objects alone from now on, or everything. Returns false if there are no such objects.
    pub fn show(&mut self, only: Option<&[u32]>) -> bool {
        self.only = only.map(<[u32]>::to_vec);
        only.is_none_or(|labels| self.index.has_objects(labels))
    }

    /// Draws a picture like [`render`](crate::render::render()). Main Gaussians are indices into the index.
    pub fn render(&mut self, camera: &Camera, options: &RenderOptions) -> Result<Render> {
        let size = EngineSize::new(1, (camera.width, camera.height));
        let mut open = Band::split(camera.height, size.band(&self.shape).unwrap_or(camera.height));
        // The next band is at the end of the list.
        open.reverse();
        let mut whole: Option<Render> = None;
        while let Some(band) = open.pop() {
            match self.band(camera, band, options)? {
                BandResult::Picture(drawn) => whole = Some(drawn.below(whole)),
                BandResult::TooLarge(error) => {
                    let rows = (band.rows / 2).next_multiple_of(self.shape.tile_height);
                    if rows >= band.rows {
                        return Err(error);
                    }
                    open.push(Band { first: band.first + rows, rows: band.rows - rows });
                    open.push(Band { first: band.first, rows });
                }
            }
        }
        whole.ok_or_else(|| Error::usage("camera", "has an image of 0 rows"))
    }

    /// Draws some rows of a picture, if the Gaussians that they may show fit.
    fn band(&mut self, camera: &Camera, band: Band, options: &RenderOptions) -> Result<BandResult> {
        let of =
            |part: &Camera| uniforms::view_uniforms(part, self.index.origin, &self.shape, options.near, [0.0; 3], 0);
        let seen =
            self.index.seen(&uniforms::with_slopes_of(of(&band.camera(camera)), &of(camera)), self.only.as_deref());
        let part = |error| BandResult::TooLarge(part_error(error, (camera.width, band.rows), seen.len()));
        if let Some(error) = self.labels().and_then(|labels| tell_apart(seen.iter().map(|&at| labels[at as usize]))) {
            return Ok(part(error));
        }
        let size = EngineSize::new((seen.len() as u64).max(1), (camera.width, band.rows));
        if let Some(error) = self.make_engine(size.with_labels(labels_of(self.model)))? {
            return Ok(part(error));
        }
        let model = self.model.rows(self.index.numbers(&seen), self.index.far)?;
        match self.draw(&model, camera, band, options) {
            // The device counted more (splat, tile) pairs than assumed.
            Err(error @ Error::OutOfMemory { .. }) => {
                self.engine = None;
                Ok(part(error))
            }
            drawn => {
                let mut drawn = drawn?;
                let place = |row: i32| usize::try_from(row).map_or(row, |row| seen[row] as i32);
                drawn.top_id.iter_mut().for_each(|row| *row = place(*row));
                Ok(BandResult::Picture(drawn))
            }
        }
    }

    fn draw(&mut self, model: &Gaussians, camera: &Camera, band: Band, options: &RenderOptions) -> Result<Render> {
        let engine = self.engine.as_mut().ok_or_else(|| Error::Bug("there is no engine".to_owned()))?;
        engine.upload_model(model)?;
        let uniforms = engine.band_uniforms(camera, band, options.near, options.background);
        render_band(engine, &uniforms, options)
    }

    /// Makes an engine of at least this size, unless there is one. Returns the error if it does not fit.
    fn make_engine(&mut self, size: EngineSize) -> Result<Option<Error>> {
        let mut wanted = size;
        if let Some(engine) = &self.engine {
            let old = engine.size();
            wanted.gaussians = size.gaussians.max(old.gaussians);
            wanted.image = (size.image.0.max(old.image.0), size.image.1.max(old.image.1));
            if wanted == *old {
                return Ok(None);
            }
        }
        if wanted != size && prediction(&self.gpu, wanted, self.options)?.is_some() {
            wanted = size;
        }
        if let Some(error) = prediction(&self.gpu, wanted, self.options)? {
            return Ok(Some(error));
        }
        // Free the memory of the old engine first.
        self.engine = None;
        self.engine = Some(Engine::new(Arc::clone(&self.gpu), wanted, self.options)?);
        Ok(None)
    }
}

/// A part of a picture, or the reason why it is too large.
enum BandResult {
    Picture(Render),
    TooLarge(Error),
}

/// Adds to the error which part of a picture does not fit.
fn part_error(error: Error, (width, height): (u32, u32), count: usize) -> Error {
    match error {
        Error::OutOfMemory { what, needed, limit_name, limit, .. } => Error::OutOfMemory {
            what: format!("{what}, for {width} x {height} px that may show {count} Gaussians,"),
            needed,
            limit_name,
            limit,
            cure: "allow more memory, draw smaller pictures, or draw a part of the model".to_owned(),
        },
        other => other,
    }
}
