//! Prefetches the pixels of the next steps on threads while the device works.
//!
//! The order of views is known in advance. The result of a thread depends only on step and view, so that prefetching
//! does not change any bits.

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

/// Most steps to prefetch: enough that preparing one step never delays the device.
const STEPS_AHEAD_MAX: usize = 8;

/// The pixels of a step, with their camera.
#[derive(Debug)]
pub(in crate::train) struct StepPixels {
    pub(in crate::train) photo: Arc<Photo>,
    /// The mask in device layout; empty without a mask and at smaller sizes.
    pub(in crate::train) view_labels: Arc<Vec<u32>>,
    /// 1 / known depth of each pixel, 0 for unknown; empty in a step without.
    pub(in crate::train) depths: Vec<f32>,
    pub(in crate::train) camera: Camera,
    /// Number of pixels that count.
    pub(in crate::train) valid_pixels: u64,
}

/// The pixels that a step requests.
pub(in crate::train) struct Request {
    pub(in crate::train) step: u32,
    /// Index of the part.
    pub(in crate::train) index: usize,
    pub(in crate::train) band: Band,
    pub(in crate::train) photo: Pixels<Photo>,
    /// The mask in device layout and the number of valid pixels, at full size.
    pub(in crate::train) full: Option<(Pixels<Vec<u32>>, u64)>,
    /// Known depths of the photo, in a step that compares them.
    pub(in crate::train) depths: Option<KnownDepths>,
    /// Camera at the step's size.
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

/// Threads that make the pixels of the next steps. For each step: index of the part, and thread.
#[derive(Debug)]
pub(in crate::train) struct Prefetch {
    running: BTreeMap<u32, (usize, JoinHandle<Result<StepPixels>>)>,
    steps: usize,
    last: u32,
}

impl Prefetch {
    /// Prefetches for the steps up to `last`.
    pub(in crate::train) fn new(views: &[TrainView], last: u32) -> Self {
        let waits = views.iter().map(|view| &view.photo).filter(|photo| !photo.is_held());
        let steps = waits.map(Pixels::at_once).min().map_or(0, |most| most.min(STEPS_AHEAD_MAX));
        Self { running: BTreeMap::new(), steps, last }
    }

    /// Returns the number of steps to prefetch; 0 if all photos are in memory.
    pub(in crate::train) fn steps(&self) -> usize {
        self.steps
    }

    /// Starts to make the pixels of a step, unless this was already done.
    pub(in crate::train) fn begin(&mut self, request: Request) {
        let is_running = self.running.get(&request.step).is_some_and(|(index, _)| *index == request.index);
        if is_running || request.step > self.last {
            return;
        }
        let (step, index) = (request.step, request.index);
        // If no thread can be started, the step makes its pixels itself.
        if let Ok(thread) = thread::Builder::new().name("photos".to_owned()).spawn(|| request.make()) {
            self.running.insert(step, (index, thread));
        }
    }

    /// Returns the pixels of a step. Drops pixels of steps that are not among the next ones, because training may
    /// restart from an earlier step.
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
