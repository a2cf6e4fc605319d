//! A training from a folder with photos to a folder with a model: locked, resumed, watched, saved, scored.
//!
//! [`train`] is what `labelgs train` does, without the terminal. Its folder holds what README calls the outputs of a run.

mod checkpoints;
mod finish;
pub(crate) mod models;
pub(crate) mod observer;
mod occluders;
mod prepare;
mod preview;
mod recovery;
mod resume;
pub(crate) mod settings;
mod steps;
mod summary;

pub use models::latest_model;
pub use observer::{Event, Flow, Live, Observer};
pub use occluders::OccluderFiles;
pub use settings::{RunOptions, Settings};
pub use summary::Summary;

pub use crate::train::{Densified, LabelRule, Occlusion, StepReport, TrainConfig};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::scene::{Dataset, View};
use crate::train::Trainer;
use checkpoints::Checkpoints;
use models::Models;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Settings to go on with, made of those of the checkpoint; it is given none where there is no checkpoint.
pub type Changed<'a> = dyn Fn(Option<&Settings>) -> Result<Settings> + 'a;

/// Where a run starts.
#[allow(clippy::large_enum_variant, reason = "there is one in a run")]
pub enum Start<'a> {
    /// At step 1. Checkpoints of an earlier run in the folder go when this run has one.
    New(Settings),
    /// At the newest whole checkpoint in the folder; at step 1 where there is none.
    Newest(&'a Changed<'a>),
}

/// What a run is given besides its settings, in its checkpoints too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Folder of id masks, one per view by name; without it the model has no labels.
    pub masks: Option<PathBuf>,
    /// Most bytes of the device's memory.
    pub memory_limit: Option<u64>,
    /// Largest share of the photos, from 0 to 1, that may be undecodable.
    pub max_bad_photos: Option<f32>,
    /// Photos and points may lie outside of the scene's folder.
    pub allow_outside: bool,
}

/// A training that is asked for.
pub struct Request<'a> {
    /// Folder of the scene (COLMAP or transforms.json), or one .json file.
    pub scene: PathBuf,
    /// Folder of the run.
    pub output: PathBuf,
    /// Where it starts, and its settings.
    pub start: Start<'a>,
    /// Masks and bounds; a run that goes on has those of its checkpoint where none are given.
    pub inputs: Inputs,
    /// Files with occluders, where the run does not look for them itself.
    pub occluders: Option<OccluderFiles>,
    /// If the device is lost, open it again and go on from the newest checkpoint, as long as there is a new one each
    /// time. The pass that lost it is named, at some cost in time.
    pub restart: bool,
}

impl<'a> Request<'a> {
    /// A new run with the default settings and without masks.
    pub fn new(scene: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            scene: scene.into(),
            output: output.into(),
            start: Start::New(Settings::default()),
            inputs: Inputs::default(),
            occluders: None,
            restart: false,
        }
    }
}

/// Opens the device. It is called anew after a loss of the device.
pub type Open<'a> = dyn Fn() -> Result<Arc<Gpu>> + 'a;

/// Trains a model. What was learnt is saved also where the observer stops the run, and where memory ends it.
///
/// # Errors
///
/// Settings and files that make no sense, before anything is written; a device without memory or that is lost; parameters
/// that become NaN, also after a second try with half the learning rates; outputs that cannot be written.
pub fn train(request: &Request, open: &Open, observer: &mut dyn Observer) -> Result<Summary> {
    recovery::over_losses(request, &mut |is_again| train_once(request, is_again, open, observer))
}

/// A training as far as one device carries it.
fn train_once(request: &Request, is_again: bool, open: &Open, observer: &mut dyn Observer) -> Result<Summary> {
    let prepared = prepare::prepare(request, is_again)?;
    let mut run = prepare::begin(prepared, request, open()?, observer)?;
    run.write_records()?;
    run.tell(Event::Started { after: run.trainer.steps_done(), steps: run.settings.train.iterations })?;
    let start = Instant::now();
    recovery::over_numeric_failures(&mut run).map_err(|error| run.keep_model(error))?;
    run.hold_records()?;
    // What was learnt is saved either way.
    let kept = run.keep_if_stopped();
    let model = run.save_labelled()?;
    let mut summary = run.summary(model, start.elapsed());
    run.finish(&mut summary, kept)?;
    Ok(summary)
}

/// A run under way.
struct Run<'a> {
    request: &'a Request<'a>,
    settings: Settings,
    /// What the given occluders were made from.
    occlusion: Option<String>,
    /// What `config.toml` says besides the settings.
    facts: Vec<(&'static str, String)>,
    names: Option<crate::io::label_table::LabelTable>,
    dataset: Dataset,
    /// The view of the preview pictures.
    preview: Option<View>,
    trainer: Trainer,
    checkpoints: Checkpoints,
    models: Models,
    observer: &'a mut dyn Observer,
    /// The observer has asked for the end.
    stopped: bool,
}

impl Run<'_> {
    /// Tells the observer of an event and does what it answers.
    fn tell(&mut self, event: Event<'_>) -> Result<()> {
        let mut flow = self.observer.on(&event, &mut Live::new(&mut self.trainer))?;
        loop {
            match flow {
                Flow::Continue => return Ok(()),
                Flow::Save => return self.save_checkpoint(),
                Flow::Stop => {
                    self.stopped = true;
                    return Ok(());
                }
                Flow::Pause => {
                    let step = self.trainer.steps_done();
                    flow = self.observer.on(&Event::Paused { step }, &mut Live::new(&mut self.trainer))?;
                }
            }
        }
    }

    /// Says something that a person should know, in the log and to the observer.
    fn warn(&mut self, text: &str) -> Result<()> {
        tracing::warn!("{text}");
        self.tell(Event::Warning(text))
    }
}
