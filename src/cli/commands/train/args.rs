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
    /// List all settings, or describe the setting KEY, without training.
    #[arg(long, value_name = "KEY", num_args = 0..=1, exclusive = true, help_heading = "Settings")]
    pub settings: Option<Option<String>>,
    /// Scene: a folder (COLMAP, transforms.json, poses_bounds.npy, Metashape) or a .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Output folder for the model, settings and logs.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Folder of id masks, named as the photos. Without masks, the model has no labels.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// For a scene without masks, make them with the segmentation network in this folder, as for `masks make`. labelgs
    /// trains a model in OUT/plain, makes masks in OUT/masks, chooses objects by agreement of all views, and continues
    /// training with these masks for a third of the steps. With --resume, an interrupted run resumes in its stage.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["masks", "block", "occluders"])]
    pub network: Option<PathBuf>,
    /// Flags of the training.
    #[command(flatten)]
    pub how: TrainFlags,
    /// The page that shows the run.
    #[command(flatten)]
    pub watch: WatchArgs,
}

/// Flags of a training, without scene and folder.
#[derive(Args, Clone, Debug)]
pub struct TrainFlags {
    /// Resume from the newest checkpoint in OUT, with its settings and masks. Without a checkpoint, start at step 1.
    #[arg(long)]
    pub resume: bool,
    /// If the device is lost, reopen it and resume from the newest checkpoint, as long as each attempt reaches a new
    /// checkpoint. Errors then name the pass that lost the device, which costs some time.
    #[arg(long, help_heading = "Device")]
    pub restart: bool,
    /// File of occluders from `labelgs occlusion` or an earlier run. Default: occluders are found from rendered depth.
    #[arg(long, value_name = "FILE", help_heading = "Labels")]
    pub occluders: Option<PathBuf>,
    /// Start from this model of any trainer instead of the scene's points: a model file or a run. Photos have full size
    /// and spherical harmonics their full degree from the first step.
    #[arg(long, value_name = "MODEL", help_heading = "Training")]
    pub init: Option<PathBuf>,
    /// Train only this block of the scene: a folder from `labelgs blocks split`. The block sets the views, the initial
    /// model, and the default steps, seed and number of Gaussians.
    #[arg(long, value_name = "DIR", conflicts_with = "init", help_heading = "Training")]
    pub block: Option<PathBuf>,
    /// Folder of images, named as masks, that mark pixels to ignore: pixels above 0 count in no loss or vote.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub ignore: Option<PathBuf>,
    /// Folder of depth maps for supervision, named as the photos, in world units along the camera axis: EXR, NPY or
    /// PFM. Default: the depths of the reconstruction's points.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub depths: Option<PathBuf>,
    /// Settings file (TOML), such as config.toml of an earlier run. Flags and --set override it.
    #[arg(long, value_name = "FILE.toml", help_heading = "Settings")]
    pub config: Option<PathBuf>,
    /// Change a setting that has no flag, such as label_weight=0.3; --settings lists them. Repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment, help_heading = "Settings")]
    pub sets: Vec<Assignment>,
    /// Limit of device memory, such as 1500M or 2G. It limits the number of Gaussians.
    #[arg(long, value_name = "SIZE", value_parser = bytes, help_heading = "Device")]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub files: FileArgs,
    /// Preset of length and level of detail: draft for a first look, standard, best, or paper for the settings of
    /// LabelGS.
    ///
    /// Flags and --set override the preset. The paper's settings are, where ours differ:
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
            // A resumed run compares the whole file with its checkpoint.
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
