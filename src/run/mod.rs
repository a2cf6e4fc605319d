//! Trains a model: from a folder of photos to the folder of a run.
//!
//! [`train`] is the command `labelgs train` without the terminal. Its input is a [`Request`]: scene, output folder,
//! [`Settings`] and whether to resume ([`Start`]). An [`Observer`] receives events and may pause, save or stop the run.
//! The result is a [`Summary`]; [`guide::outputs`](crate::guide::outputs) lists the files of the run folder.

mod block;
mod checkpoints;
mod depths;
mod every;
mod finish;
pub(crate) mod history;
pub(crate) mod info;
pub mod models;
mod objects;
pub(crate) mod observer;
mod occluders;
mod passes;
mod pictures;
mod prepare;
mod preview;
mod recovery;
pub(crate) mod report;
mod resume;
pub(crate) mod settings;
mod steps;
pub(crate) mod summary;
mod thumbnails;

pub use every::Every;
pub use models::{latest_model, model_file};
pub use objects::ObjectSummary;
pub use observer::{Event, Flow, LiveScene, Observer};
pub use report::write as write_report;
pub use settings::{RunOptions, Settings};
pub use summary::Summary;

pub use crate::train::{DensifyCounts, LabelRule, LabelWork, Occlusion, StepKind, StepReport, TrainConfig};
pub use crate::train::{ExposureMode, Preset, StrategyKind};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::phases::{self, Phase};
use crate::scene::{Dataset, View};
use crate::train::Trainer;
use checkpoints::Checkpoints;
use history::Recorder;
use info::Info;
use models::Models;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Makes the settings of a resumed run from the checkpoint's settings, which are `None` if there is no checkpoint.
pub type ResumeSettings<'a> = dyn Fn(Option<&Settings>) -> Result<Settings> + 'a;

/// The first step of a run.
#[allow(clippy::large_enum_variant, reason = "there is one in a run")]
pub enum Start<'a> {
    /// Step 1. The first checkpoint of this run replaces those of an earlier run in the folder.
    New(Settings),
    /// The newest intact checkpoint in the folder, or step 1 if there is none.
    Newest(&'a ResumeSettings<'a>),
}

/// The inputs of a run besides its settings. Checkpoints also store them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Folder of id masks, one per view by name. Without masks, the model has no labels.
    pub masks: Option<PathBuf>,
    /// Folder of pictures, named like masks; photo pixels are ignored where they are above 0. See
    /// [`crate::scenes::LoadOptions::ignore`].
    #[serde(default)]
    pub ignore: Option<PathBuf>,
    /// Folder of depth maps in world units, which replace the points of the reconstruction for
    /// [`TrainConfig::depth_weight`].
    #[serde(default)]
    pub known_depths: Option<PathBuf>,
    /// Limit on the device memory, bytes.
    pub memory_limit: Option<u64>,
    /// Largest share of damaged photos that is accepted, 0 to 1.
    pub max_bad_photos: Option<f32>,
    /// Allows photos and points outside of the scene folder.
    pub allow_outside: bool,
    /// Folder of the photos, if they are not where the scene lists them. See [`crate::scenes::Lookup::images`].
    #[serde(default)]
    pub images: Option<PathBuf>,
}

/// A request for a run.
pub struct Request<'a> {
    /// Scene folder or file, see [`crate::scenes::open`].
    pub scene: PathBuf,
    /// Folder of the run.
    pub output: PathBuf,
    /// First step and settings.
    pub start: Start<'a>,
    /// Masks and limits. In a resumed run, empty fields take the values of the checkpoint.
    pub inputs: Inputs,
    /// Model to start from instead of the scene's points: a file of any format, from any trainer, or a run folder.
    pub init: Option<PathBuf>,
    /// Folder of a block of the scene ([`crate::blocks`]): only this part is trained, starting from the block's first
    /// model. The settings are those of [`Settings::for_block`].
    pub block: Option<PathBuf>,
    /// File of occluder lists, for [`Occlusion::File`].
    pub occluders: Option<PathBuf>,
    /// Reopens a lost device and continues from the newest checkpoint, as long as there was a new checkpoint since the
    /// last loss. Errors then name the pass that lost the device, at some cost in time.
    pub restart: bool,
    /// The command line, for the report.
    pub command: Option<String>,
    /// The warnings of the log since the run began, for the report. Without it, the report has only the run's own
    /// warnings.
    pub warnings: Option<&'a Warnings<'a>>,
}

/// Returns the text of all warnings so far.
pub type Warnings<'a> = dyn Fn() -> Vec<String> + 'a;

impl<'a> Request<'a> {
    /// Makes a new run with the default settings and without masks.
    pub fn new(scene: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            scene: scene.into(),
            output: output.into(),
            start: Start::New(Settings::default()),
            inputs: Inputs::default(),
            init: None,
            block: None,
            occluders: None,
            restart: false,
            command: None,
            warnings: None,
        }
    }
}

/// Opens the device, at the start and after each loss of the device.
pub type OpenGpu<'a> = dyn Fn() -> Result<Arc<Gpu>> + 'a;

/// Trains a model. Saves the model even if the observer stops the run or memory runs out.
///
/// # Errors
///
/// Invalid settings and inputs, before anything is written; too little memory or a lost device; parameters that become
/// NaN even with half the learning rates; outputs that cannot be written.
pub fn train(request: &Request, open: &OpenGpu, observer: &mut dyn Observer) -> Result<Summary> {
    recovery::over_losses(request, &mut |is_again| train_once(request, is_again, open, observer))
}

/// Trains until the end or until the device is lost.
fn train_once(request: &Request, is_again: bool, open: &OpenGpu, observer: &mut dyn Observer) -> Result<Summary> {
    let prepared = prepare::prepare(request, is_again)?;
    phases::take();
    let mut run = prepare::begin(prepared, request, open()?, observer)?;
    run.write_records()?;
    run.write_info()?;
    run.tell(Event::Started { after: run.trainer.steps_done(), steps: run.settings.train.iterations })?;
    run.history.start();
    let done = phases::timed(Phase::Steps, || recovery::over_numeric_failures(&mut run));
    run.info.note_phases();
    done.map_err(|error| run.keep_model(error))?;
    run.hold_records()?;
    // Save the model in both cases.
    let kept = run.keep_if_stopped();
    let (path, model) = run.save_labelled()?;
    let mut summary = run.summary(path);
    run.finish(&mut summary, &model, kept)?;
    Ok(summary)
}

struct Run<'a> {
    request: &'a Request<'a>,
    settings: Settings,
    /// Source of the occluders, if given.
    occlusion: Option<String>,
    /// Comments for `config.toml`: name and value.
    facts: Vec<(&'static str, String)>,
    names: Option<crate::files::label_table::LabelTable>,
    dataset: Dataset,
    /// View of the preview pictures.
    preview: Option<View>,
    /// Time of the last preview.
    previewed: Instant,
    trainer: Trainer,
    checkpoints: Checkpoints,
    models: Models,
    history: Recorder,
    info: Info,
    observer: &'a mut dyn Observer,
    stopped: bool,
}

impl Run<'_> {
    /// Passes an event to the observer and follows its answer.
    fn tell(&mut self, event: Event<'_>) -> Result<()> {
        let mut flow = self.ask(&event)?;
        let mut is_paused = false;
        loop {
            match flow {
                Flow::Continue => return Ok(()),
                Flow::Save => {
                    self.save_checkpoint()?;
                    // A save does not end a pause.
                    if !is_paused {
                        return Ok(());
                    }
                }
                Flow::Stop => {
                    self.stopped = true;
                    return Ok(());
                }
                Flow::Pause => is_paused = true,
            }
            let step = self.trainer.steps_done();
            flow = self.ask(&Event::Paused { step })?;
        }
    }

    fn ask(&mut self, event: &Event<'_>) -> Result<Flow> {
        let mut live = LiveScene::new(&mut self.trainer, &mut self.history, &self.dataset, self.names.as_ref());
        self.observer.observe(event, &mut live)
    }

    /// Logs a warning, and passes it to the observer.
    fn warn(&mut self, text: &str) -> Result<()> {
        tracing::warn!("{text}");
        self.note_warning(text);
        self.tell(Event::Warning(text))
    }
}
