//! Arguments of `labelgs train`. The settings are fields of the run's own structs; see
//! [`crate::options`](mod@crate::options).

use crate::cli::commands::view::WatchArgs;
use crate::cli::support::FileArgs;
use crate::cli::support::parsers::bytes;
use crate::cli::support::settings::{Assignment, assignment, by_key};
use crate::options::typed::TypedOptions;
use crate::run::{Inputs, Request, ResumeSettings, RunOptions, Settings, Start};
use crate::scenes::ReadOptions;
use crate::train::{Occlusion, Preset, TrainConfig};
use crate::{Error, Result, Setting};
use clap::Args;
use std::path::{Path, PathBuf};

/// `labelgs train`.
#[derive(Args, Clone, Debug)]
pub struct TrainArgs {
    /// List all settings, or tell all of one, and train nothing.
    #[arg(long, value_name = "KEY", num_args = 0..=1, exclusive = true, help_heading = "Settings")]
    pub settings: Option<Option<String>>,
    /// Folder of the scene (COLMAP, transforms.json, poses_bounds.npy, Metashape), or one .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder for the model, its settings and the logs of the run.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Folder of id masks, one per view by name. Without masks the model has no labels.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// Folder with a segmentation network, as for `masks make`, for a scene without masks: a model is trained in
    /// OUT/plain, masks are made in OUT/masks, all views choose objects among them, and the model is trained on with these, for
    /// a third of the steps. With --resume, a stopped run goes on in the stage where it was.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["masks", "block", "occluders"])]
    pub network: Option<PathBuf>,
    /// How it trains.
    #[command(flatten)]
    pub how: TrainFlags,
    /// A page that shows it.
    #[command(flatten)]
    pub watch: WatchArgs,
}

/// Flags of a training, without scene and folder.
#[derive(Args, Clone, Debug)]
pub struct TrainFlags {
    /// Go on from the newest checkpoint in OUT, with its settings and masks. Without a checkpoint, start at step 1.
    #[arg(long)]
    pub resume: bool,
    /// Reopen a lost device and go on from the newest checkpoint, as long as each attempt makes a new checkpoint. Names
    /// the pass that lost the device; this costs some time.
    #[arg(long, help_heading = "Device")]
    pub restart: bool,
    /// File of occluders, as written by `labelgs occlusion` or an earlier run. Default: the depth of the model itself
    /// shows which object hides which.
    #[arg(long, value_name = "FILE", help_heading = "Labels")]
    pub occluders: Option<PathBuf>,
    /// Start from this model, of any trainer, in place of the scene's points: a file of any format, or the folder of a
    /// run. All bands of colour and the full size of the photos count from the first step.
    #[arg(long, value_name = "MODEL", help_heading = "Training")]
    pub init: Option<PathBuf>,
    /// Train this block of the scene alone: a folder that `labelgs blocks split` wrote. It decides the views, the first
    /// model, steps, seed and number of Gaussians. Flags override what it decides.
    #[arg(long, value_name = "DIR", conflicts_with = "init", help_heading = "Training")]
    pub block: Option<PathBuf>,
    /// Folder of pictures named as masks: pixels above 0 are left out of the loss and of votes.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub ignore: Option<PathBuf>,
    /// Folder of depth maps that the training is held to, one per photo by name, world units along the axis of the camera:
    /// EXR, NPY or PFM. Default: the points of the reconstruction.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub depths: Option<PathBuf>,
    /// Settings in TOML, such as config.toml of an earlier run. Flags and --set override them.
    #[arg(long, value_name = "FILE.toml", help_heading = "Settings")]
    pub config: Option<PathBuf>,
    /// Set what has no flag, such as label_weight=0.3; --settings lists it. May be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment, help_heading = "Settings")]
    pub sets: Vec<Assignment>,
    /// Limit of device memory, such as 1500M or 2G. It bounds the number of Gaussians.
    #[arg(long, value_name = "SIZE", value_parser = bytes, help_heading = "Device")]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub files: FileArgs,
    /// Start from settings for a length and a level of detail: draft for a first look, standard, best, or paper for those
    /// of LabelGS.
    ///
    /// Flags and --set override them. Those of the paper are, where ours differ:
    #[arg(long, value_name = "NAME", conflicts_with = "config", hide_possible_values = true)]
    pub preset: Option<Preset>,
    #[command(flatten)]
    pub read: TypedOptions<ReadOptions>,
    /// The training.
    #[command(flatten)]
    pub train: TypedOptions<TrainConfig>,
    /// Files of the run.
    #[command(flatten)]
    pub run: TypedOptions<RunOptions>,
}

impl TrainFlags {
    /// Returns the checked settings. What is typed overrides a file, a file a checkpoint, a checkpoint the default.
    pub fn settings(&self, checkpoint: Option<&Settings>) -> Result<Settings> {
        let decided = |key: &&&str| self.block.is_some() && self.is_typed(key);
        if let Some(key) = ["grow_box", "test_every"].iter().find(decided) {
            return Err(Error::usage(Setting(key), "cannot be given with a block, which decides it; leave out one"));
        }
        let mut settings = match (&self.config, checkpoint) {
            // A run that goes on compares the whole file with its checkpoint.
            (Some(path), _) => Settings::read(path)?,
            (None, Some(found)) => found.clone(),
            (None, None) => self.preset.map(Settings::preset).unwrap_or_default(),
        };
        if let (Some(block), None) = (&self.block, checkpoint) {
            settings.for_block(block)?;
        }
        let sets = by_key(&self.sets, |key| self.has_flag(key))?;
        let applied = self.read.apply(&mut settings.read, &sets);
        let applied = applied.and_then(|()| self.train.apply(&mut settings.train, &sets));
        let applied = applied.and_then(|()| self.run.apply(&mut settings.run, &sets));
        applied.map_err(|error| Error::Bug(format!("flags: {error}")))?;
        if self.occluders.is_some() {
            if self.is_typed("occlusion") {
                return Err(Error::usage(Setting("occlusion"), "cannot be given with --occluders; leave out one"));
            }
            settings.train.occlusion = Occlusion::File;
        }
        settings.check()?;
        Ok(settings)
    }

    /// Returns true if the setting is on the command line, in any form.
    pub fn is_typed(&self, key: &str) -> bool {
        self.has_flag(key) || self.sets.iter().any(|set| set.is_of(key))
    }

    fn has_flag(&self, key: &str) -> bool {
        self.read.is_typed(key) || self.train.is_typed(key) || self.run.is_typed(key)
    }

    /// Returns the request to train a scene into a folder. `settings` maps a checkpoint's settings to the new ones.
    pub fn request<'a>(
        &self,
        (scene, output): (&Path, &Path),
        masks: Option<PathBuf>,
        settings: &'a ResumeSettings,
    ) -> Result<Request<'a>> {
        let start = if self.resume { Start::Newest(settings) } else { Start::New(settings(None)?) };
        let occluders = self.occluders.clone();
        if masks.is_none() && occluders.is_some() {
            return Err(Error::usage("--occluders", "needs the masks of the objects: --masks DIR"));
        }
        let inputs = Inputs {
            masks,
            ignore: self.ignore.clone(),
            known_depths: self.depths.clone(),
            memory_limit: self.memory_limit,
            max_bad_photos: self.files.max_bad_photos,
            images: self.files.images.clone(),
            allow_outside: self.files.allow_outside,
        };
        let (init, block) = (self.init.clone(), self.block.clone());
        Ok(Request { start, inputs, init, block, occluders, restart: self.restart, ..Request::new(scene, output) })
    }
}
