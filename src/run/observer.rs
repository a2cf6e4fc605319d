//! What a terminal, a web page and a test all are: they hear what a run does, may look at the scene between two steps,
//! and may pause, save and stop.

use super::Summary;
use crate::error::Result;
use crate::eval::scores::Scores;
use crate::render::{Parts, RenderOptions, Rendered, render};
use crate::scene::{Camera, Gaussians};
use crate::train::{Densified, StepReport, Trainer};
use std::path::Path;

/// Something that happened in a run.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// The scene is read and the model is on the device; the first step comes next.
    Started {
        /// Step that the run goes on after, 0 at its start.
        after: u32,
        /// Steps of the whole run.
        steps: u32,
    },
    /// A step was submitted.
    Step {
        /// Step, from 1.
        step: u32,
        /// The newest step whose numbers are known; it lags behind, because two steps are in flight.
        report: Option<&'a StepReport>,
        /// No step comes after it.
        is_last: bool,
    },
    /// Gaussians were cloned, split and pruned after a step.
    Densified {
        /// Step.
        step: u32,
        /// What was done.
        what: Densified,
        /// Gaussians since.
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
    /// Something that a person should know; the run goes on. It is in the log too.
    Warning(&'a str),
    /// The run stands still because the observer paused it; it is asked again and again whether to go on.
    Paused {
        /// Steps done.
        step: u32,
    },
    /// The run has ended and everything is written.
    Done(&'a Summary),
}

/// What an observer wants of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flow {
    /// Go on.
    #[default]
    Continue,
    /// Stand still: [`Event::Paused`] comes until another answer is given. The observer decides how long it waits then.
    Pause,
    /// Write a checkpoint now, and go on.
    Save,
    /// Write the model and a checkpoint, and end. [`Summary::stopped`] tells of it.
    Stop,
}

/// Hears what a run does.
pub trait Observer {
    /// An event. An error ends the run as an error of its own would.
    fn on(&mut self, event: &Event<'_>, live: &mut Live<'_>) -> Result<Flow>;
}

/// Nobody listens.
impl Observer for () {
    fn on(&mut self, _: &Event<'_>, _: &mut Live<'_>) -> Result<Flow> {
        Ok(Flow::Continue)
    }
}

/// The scene in training, between two steps. What is asked of it changes no bit of the training.
pub struct Live<'a> {
    trainer: &'a mut Trainer,
}

impl<'a> Live<'a> {
    pub(super) fn new(trainer: &'a mut Trainer) -> Self {
        Self { trainer }
    }

    /// Steps done.
    pub fn step(&self) -> u32 {
        self.trainer.steps_done()
    }

    /// Gaussians of the model.
    pub fn gaussian_count(&self) -> u32 {
        self.trainer.gaussian_count()
    }

    /// A picture of the scene as it is now, from any camera and of any size, with the parts that are asked for.
    pub fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Rendered> {
        self.trainer.drain()?;
        let options = RenderOptions { parts, ..self.trainer.render_options() };
        let engine = self.trainer.engine_mut();
        engine.grow_image(camera.width, camera.height)?;
        render(engine, camera, &options)
    }

    /// The model as it is now, with the labels of the last count of votes.
    pub fn model(&mut self) -> Result<Gaussians> {
        self.trainer.model()
    }
}
