//! Pixels of the next steps, made on threads while the device works.
//!
//! The order of views is known ahead. What a thread makes depends on step and view alone, so that a step has the same
//! bits whether its pixels were made ahead or are made when it begins.

use super::known_depths::KnownDepths;
use super::part::{labels_of, photo_of};
use super::step_input::{TrainView, valid_pixels};
use crate::engine::Band;
use crate::error::{Error, Result};
use crate::files::resize::shrink_photo;
use crate::scene::{Camera, Photo, Pixels};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

/// Most steps ahead: more than the device needs to take the time of one.
const STEPS_AHEAD_MAX: usize = 8;

/// The pixels of a step, with their camera.
#[derive(Debug)]
pub(in crate::train) struct StepPixels {
    pub(in crate::train) photo: Arc<Photo>,
    /// The mask in the layout of the device; empty without a mask and in smaller sizes.
    pub(in crate::train) view_labels: Arc<Vec<u32>>,
    /// 1 / known depth of each pixel, 0 for unknown; empty in a step without.
    pub(in crate::train) depths: Vec<f32>,
    pub(in crate::train) camera: Camera,
    /// Number of pixels that count.
    pub(in crate::train) valid_pixels: u64,
}

/// What a step asks for.
pub(in crate::train) struct Request {
    pub(in crate::train) step: u32,
    /// Index of the part.
    pub(in crate::train) index: usize,
    pub(in crate::train) band: Band,
    pub(in crate::train) photo: Pixels<Photo>,
    /// The mask in the layout of the device and the number of pixels that count, at full size.
    pub(in crate::train) full: Option<(Pixels<Vec<u32>>, u64)>,
    /// Depths that the photo is known to have, in a step that compares them.
    pub(in crate::train) depths: Option<KnownDepths>,
    /// Camera of the size of the step.
    pub(in crate::train) camera: Camera,
}

impl Request {
    fn make(self) -> Result<StepPixels> {
        let (band, camera) = (self.band, self.camera);
        let whole = self.photo.get()?;
        let size = (whole.width, whole.height);
        let part = photo_of(band, whole);
        let (photo, view_labels, valid_pixels) = match self.full {
            Some((labels, valid)) => {
                let labels = labels_of(band, part.width, labels.get()?);
                (part, labels, valid)
            }
            None => {
                let photo = Arc::new(shrink_photo(&part, camera.width, camera.height));
                let valid = valid_pixels(&photo.rgba);
                (photo, Arc::default(), valid)
            }
        };
        let depths = self.depths.map_or(Vec::new(), |known| known.drawn(size, band, &photo));
        Ok(StepPixels { photo, view_labels, depths, camera, valid_pixels })
    }
}

/// Threads that make the pixels of the next steps, by step: index of the part, and its pixels.
#[derive(Debug)]
pub(in crate::train) struct Prefetch {
    running: BTreeMap<u32, (usize, JoinHandle<Result<StepPixels>>)>,
    steps: usize,
    last: u32,
}

impl Prefetch {
    /// Makes one for the steps up to `last`.
    pub(in crate::train) fn new(views: &[TrainView], last: u32) -> Self {
        let waits = views.iter().map(|view| &view.photo).filter(|photo| !photo.is_held());
        let steps = waits.map(Pixels::at_once).min().map_or(0, |most| most.min(STEPS_AHEAD_MAX));
        Self { running: BTreeMap::new(), steps, last }
    }

    /// Number of steps whose pixels are made ahead; 0 if all are in memory.
    pub(in crate::train) fn steps(&self) -> usize {
        self.steps
    }

    /// Begins to make the pixels of a step, unless that was done before.
    pub(in crate::train) fn begin(&mut self, request: Request) {
        let is_running = self.running.get(&request.step).is_some_and(|(index, _)| *index == request.index);
        if is_running || request.step > self.last {
            return;
        }
        let (step, index) = (request.step, request.index);
        // Without a thread, the step makes its pixels itself.
        if let Ok(thread) = thread::Builder::new().name("photos".to_owned()).spawn(|| request.make()) {
            self.running.insert(step, (index, thread));
        }
    }

    /// Returns the pixels of a step. Those of other steps than the next ones are dropped: a training may go back.
    pub(in crate::train) fn take(&mut self, request: Request) -> Result<StepPixels> {
        let found = self.running.remove(&request.step).filter(|(index, _)| *index == request.index);
        let next = request.step..=request.step.saturating_add(self.steps as u32);
        self.running.retain(|step, _| next.contains(step));
        match found {
            Some((_, thread)) => {
                thread.join().unwrap_or_else(|_| Err(Error::Bug("a thread that reads photos panicked".to_owned())))
            }
            None => request.make(),
        }
    }
}
