//! Events of a run, and observers that receive them: a terminal, a web page, a test. Between steps, an observer may
//! render the scene, and pause, save or stop the run.

use super::Summary;
use super::history::Recorder;
use crate::error::Result;
use crate::eval::scores::Scores;
use crate::files::label_table::LabelTable;
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::{Camera, Dataset, Gaussians};
use crate::train::{DensifyCounts, StepReport, Trainer};
use std::path::Path;

/// An event in a run.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// The scene was read, the model is on the device, and the first step is next.
    Started {
        /// Last step of the checkpoint that the run continues from; 0 for a new run.
        after: u32,
        /// Steps of the whole run.
        steps: u32,
    },
    /// A step was submitted.
    Step {
        /// Step, from 1.
        step: u32,
        /// Report of the newest finished step. It lags behind, because several steps are in flight.
        report: Option<&'a StepReport>,
        /// True for the last step.
        is_last: bool,
    },
    /// Gaussians were cloned, split and pruned after a step.
    Densified {
        /// Step.
        step: u32,
        /// Counts of the densification.
        what: DensifyCounts,
        /// Number of Gaussians afterwards.
        gaussians: u32,
    },
    /// A preview picture was written.
    Preview {
        /// Step.
        step: u32,
        /// The file.
        path: &'a Path,
    },
    /// A model was written.
    Model {
        /// Step.
        step: u32,
        /// The file.
        path: &'a Path,
    },
    /// A checkpoint was written.
    Checkpoint {
        /// Step.
        step: u32,
        /// The file.
        path: &'a Path,
    },
    /// The held-out views were scored.
    Evaluated(&'a Scores),
    /// A warning for the user; the run continues. It is also logged.
    Warning(&'a str),
    /// The observer paused the run. The event repeats until the observer answers something else.
    Paused {
        /// Steps done.
        step: u32,
    },
    /// The run has ended and everything is written.
    Done(&'a Summary),
}

/// The answer of an observer to an event.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flow {
    /// Continue.
    #[default]
    Continue,
    /// Pause: [`Event::Paused`] repeats until the answer changes. The observer should wait between repetitions.
    Pause,
    /// Write a checkpoint now and continue.
    Save,
    /// Write the model and a checkpoint, and end the run. [`Summary::stopped`] is then true.
    Stop,
}

/// Receives the events of a run.
pub trait Observer {
    /// Receives an event. An error ends the run.
    fn observe(&mut self, event: &Event<'_>, live: &mut LiveScene<'_>) -> Result<Flow>;
}

/// Ignores all events.
impl Observer for () {
    fn observe(&mut self, _: &Event<'_>, _: &mut LiveScene<'_>) -> Result<Flow> {
        Ok(Flow::Continue)
    }
}

/// The scene during training, between two steps. Queries do not affect the training, bit for bit.
pub struct LiveScene<'a> {
    trainer: &'a mut Trainer,
    history: &'a mut Recorder,
    dataset: &'a Dataset,
    names: Option<&'a LabelTable>,
}

impl<'a> LiveScene<'a> {
    pub(super) fn new(
        trainer: &'a mut Trainer,
        history: &'a mut Recorder,
        dataset: &'a Dataset,
        names: Option<&'a LabelTable>,
    ) -> Self {
        Self { trainer, history, dataset, names }
    }

    /// Returns the scene of the run, with its photos and masks.
    pub fn dataset(&self) -> &'a Dataset {
        self.dataset
    }

    /// Returns the label names, if the masks came with names.
    pub fn names(&self) -> Option<&'a LabelTable> {
        self.names
    }

    /// Returns the largest picture size that needs no additional memory, px: that of the largest photo.
    pub fn image(&mut self) -> (u32, u32) {
        self.trainer.engine_mut().size().image
    }

    /// Returns the bytes that the run uses on the device.
    pub fn memory(&mut self) -> u64 {
        self.trainer.engine_mut().memory()
    }

    /// Returns the label of each Gaussian from the last vote count; empty in a scene without masks.
    pub fn labels(&mut self) -> Result<Option<Vec<u32>>> {
        if !self.trainer.has_labels() {
            return Ok(None);
        }
        self.wait()?;
        self.trainer.engine_mut().labels().map(Some)
    }

    /// Returns true if the device is a CPU.
    pub fn is_cpu(&mut self) -> bool {
        self.trainer.engine_mut().gpu().is_cpu()
    }

    /// Returns the number of finished steps.
    pub fn step(&self) -> u32 {
        self.trainer.steps_done()
    }

    /// Returns the number of Gaussians in the model.
    pub fn gaussian_count(&self) -> u32 {
        self.trainer.gaussian_count()
    }

    /// Waits for the steps in flight. Every query does this first, so that the wait counts as training time.
    pub fn wait(&mut self) -> Result<()> {
        self.history.drain(self.trainer)
    }

    /// Renders the current scene from any camera, at any size, with the requested parts.
    pub fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Render> {
        self.wait()?;
        let options = RenderOptions { parts, ..self.trainer.render_options() };
        let engine = self.trainer.engine_mut();
        engine.grow_image(camera.width, camera.height)?;
        render(engine, camera, &options)
    }

    /// Returns the current model, with labels from the last vote count.
    pub fn model(&mut self) -> Result<Gaussians> {
        self.wait()?;
        self.trainer.model()
    }
}
