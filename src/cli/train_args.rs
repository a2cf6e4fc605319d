//! Arguments of `labelgs train`. The settings are fields of the run's own structs; see
//! [`crate::options`](mod@crate::options).

use super::args::{FileArgs, JsonFlag};
use super::values::bytes;
use super::view::WatchArgs;
use crate::options::typed::Typed;
use crate::run::{Changed, Inputs, OccluderFiles, Request, RunOptions, Settings, Start};
use crate::scene::DepthKind;
use crate::scenes::ReadOptions;
use crate::train::{Occlusion, Preset, TrainConfig};
use crate::{Error, Result};
use clap::Args;
use std::path::{Path, PathBuf};

/// `labelgs train`.
#[derive(Args, Clone, Debug)]
pub struct TrainArgs {
    /// Folder of the scene (COLMAP, transforms.json, poses_bounds.npy, Metashape), or one .json, .npy or .xml file.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder for the model, its settings and the logs of the run.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Folder of id masks, one per view by name. Without masks the model has no labels.
    #[arg(long, value_name = "DIR")]
    pub masks: Option<PathBuf>,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFlag,
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
    /// Folder of depth maps for --occlusion depth, one per photo by name: 16-bit PNG, EXR, NPY or PFM.
    #[arg(long, value_name = "DIR", requires = "depth_kind", help_heading = "Labels")]
    pub depths: Option<PathBuf>,
    /// Meaning of the values in --depths.
    #[arg(long, value_name = "KIND", value_enum, requires = "depths", help_heading = "Labels")]
    pub depth_kind: Option<DepthKind>,
    /// File of occluders, as written by `labelgs occlusion` or an earlier run.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["occlusion", "depths"], help_heading = "Labels")]
    pub occlusion_file: Option<PathBuf>,
    /// Start from this model, of any trainer, in place of the scene's points: a file of any format, or the folder of a
    /// run. All bands of colour and the full size of the photos count from the first step.
    #[arg(long, value_name = "MODEL", help_heading = "Training")]
    pub init: Option<PathBuf>,
    /// Train this block of the scene alone: a folder that `labelgs blocks split` wrote. It decides the views, the first
    /// model, steps, seed and number of Gaussians. Flags override what it decides.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["init", "grow_box", "no_test", "test_every"], help_heading = "Training")]
    pub block: Option<PathBuf>,
    /// Folder of pictures named as masks: pixels above 0 are left out of the loss and of votes.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub ignore: Option<PathBuf>,
    /// Folder of depth maps for --depth-weight, one per photo by name, world units along the axis of the camera: EXR, NPY or
    /// PFM. Default: the points of the reconstruction.
    #[arg(long, value_name = "DIR", help_heading = "Training")]
    pub known_depths: Option<PathBuf>,
    /// Settings in TOML, such as config.toml of an earlier run. Flags override them.
    #[arg(long, value_name = "FILE.toml", help_heading = "Training")]
    pub config: Option<PathBuf>,
    /// Limit of device memory, such as 1500M or 2G. It bounds the number of Gaussians.
    #[arg(long, value_name = "SIZE", value_parser = bytes, help_heading = "Device")]
    pub memory_limit: Option<u64>,
    /// Files of the scene.
    #[command(flatten)]
    pub files: FileArgs,
    /// Start from settings for a length and a level of detail: draft for a first look, standard, or best.
    ///
    /// Flags override them.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["config", "paper"])]
    pub preset: Option<Preset>,
    /// Start from the settings of the LabelGS paper, where ours differ:
    #[arg(long, conflicts_with = "config", help_heading = "Training")]
    pub paper: bool,
    /// Train on all views; hold out none.
    #[arg(long, conflicts_with = "test_every", help_heading = "Scene")]
    pub no_test: bool,
    /// How the scene is read.
    #[command(flatten)]
    pub read: Typed<ReadOptions>,
    /// The training.
    #[command(flatten)]
    pub train: Typed<TrainConfig>,
    /// Files of the run.
    #[command(flatten)]
    pub run: Typed<RunOptions>,
}

impl TrainFlags {
    /// Returns the checked settings. A flag overrides a file, a file overrides a checkpoint, a checkpoint the default.
    pub fn settings(&self, checkpoint: Option<&Settings>) -> Result<Settings> {
        let mut settings = match (&self.config, checkpoint) {
            // A run that goes on compares the whole file with its checkpoint.
            (Some(path), _) => Settings::read(path)?,
            (None, _) if self.paper => Settings::paper(),
            (None, Some(found)) => found.clone(),
            (None, None) => self.preset.map(Settings::preset).unwrap_or_default(),
        };
        if let (Some(block), None) = (&self.block, checkpoint) {
            settings.for_block(block)?;
        }
        let applied = self.read.apply(&mut settings.read);
        let applied = applied.and_then(|()| self.train.apply(&mut settings.train));
        let applied = applied.and_then(|()| self.run.apply(&mut settings.run));
        applied.map_err(|error| Error::Bug(format!("flags: {error}")))?;
        if self.no_test {
            settings.read.test_every = 0;
        }
        if self.occlusion_file.is_some() {
            settings.train.occlusion = Occlusion::File;
        }
        settings.check()?;
        Ok(settings)
    }

    /// Returns the request to train a scene into a folder. `settings` maps a checkpoint's settings to the new ones.
    pub fn request<'a>(
        &self,
        (scene, output): (&Path, &Path),
        masks: Option<PathBuf>,
        settings: &'a Changed,
    ) -> Result<Request<'a>> {
        let start = if self.resume { Start::Newest(settings) } else { Start::New(settings(None)?) };
        let occluders = match (&self.depths, self.depth_kind, &self.occlusion_file) {
            (Some(folder), Some(kind), _) => Some(OccluderFiles::Depths { folder: folder.clone(), kind }),
            (_, _, file) => file.clone().map(OccluderFiles::Lists),
        };
        if masks.is_none() && occluders.is_some() {
            let flag = if self.depths.is_some() { "--depths" } else { "--occlusion-file" };
            return Err(Error::usage(flag, "needs the masks of the objects: --masks DIR"));
        }
        let inputs = Inputs {
            masks,
            ignore: self.ignore.clone(),
            known_depths: self.known_depths.clone(),
            memory_limit: self.memory_limit,
            max_bad_photos: self.files.max_bad_photos,
            images: self.files.images.clone(),
            allow_outside: self.files.allow_outside,
        };
        let (init, block) = (self.init.clone(), self.block.clone());
        Ok(Request { start, inputs, init, block, occluders, restart: self.restart, ..Request::new(scene, output) })
    }
}
