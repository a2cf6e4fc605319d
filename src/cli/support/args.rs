//! Arguments that several commands share. They hold typed values only; the commands decide on defaults.

use crate::Result;
use crate::cli::support::parsers::share;
use crate::cli::support::shell_words::quoted_path;
use crate::run::Settings;
use crate::scenes::{LoadOptions, Lookup, PoseConvention, ReadOptions};
use clap::Args;
use std::path::{Path, PathBuf};

/// Flags of every command.
#[derive(Args, Clone, Debug, Default)]
pub struct GlobalArgs {
    /// Print errors only.
    #[arg(short, long, global = true, help_heading = "Output", conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print more messages; twice prints all. RUST_LOG overrides this flag.
    #[arg(short, long, global = true, help_heading = "Output", action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Vulkan device: number, UUID or part of the name from `labelgs devices`, or GPU-UUID from `nvidia-smi -L`. With a
    /// comma-separated list, labelgs uses the first free device and reserves it. Default: LABELGS_DEVICE, else the
    /// fastest kind of device.
    #[arg(long, value_name = "DEVICE", global = true, help_heading = "Device")]
    pub device: Option<String>,
}

/// Where the files of a scene are, and how much of it may be damaged.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Scene")]
pub struct FileArgs {
    /// Folder of the photos, if they are not where the scene lists them: a path, or a subfolder of the scene.
    #[arg(long, value_name = "DIR")]
    pub images: Option<PathBuf>,
    /// Maximum share of missing or damaged photos to skip with a warning, 0 to 1. Default: 0.1.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub max_bad_photos: Option<f32>,
    /// Also read photos and points that the scene lists outside of its folder.
    #[arg(long)]
    pub allow_outside: bool,
}

/// How a scene is read.
#[derive(Args, Clone, Debug, Default)]
pub struct ReadArgs {
    #[command(flatten)]
    pub files: FileArgs,
    /// Pose convention of the scene file: a comma-separated list of c2w or w2c, opencv or opengl, and xyzw. Default:
    /// the value of the model's run, else the convention of the format.
    #[arg(long, value_name = "WORDS", help_heading = "Scene")]
    pub poses: Option<PoseConvention>,
}

impl ReadArgs {
    /// Returns where the files of the scene are.
    pub fn lookup(&self) -> Lookup {
        Lookup {
            allow_outside: self.files.allow_outside,
            images: self.files.images.clone(),
            poses: self.poses.unwrap_or_default(),
        }
    }

    /// Puts the typed values into `options`.
    pub fn options(&self, options: LoadOptions) -> LoadOptions {
        let max_bad_photos = self.files.max_bad_photos.unwrap_or(options.max_bad_photos);
        LoadOptions { max_bad_photos, lookup: self.lookup(), ..options }
    }
}

/// How a command other than `train` reads a scene.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArgs {
    /// Hold out every N-th view, by name, for scoring; 0 holds out none. Default: 8; `eval` and `render` use the value
    /// of the model's run.
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub test_every: Option<u32>,
    /// Longest side of an image, px. Default: the photo size; `eval` and `render` use the value of the model's run.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Scene")]
    pub max_resolution: Option<u32>,
    /// Folder of images, named as masks, that mark pixels to ignore: pixels above 0 count in no vote or score.
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub ignore: Option<PathBuf>,
    /// The photos show the objects of the masks alone, by the settings of the model's run.
    #[arg(skip)]
    pub masked_only: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

impl SceneArgs {
    /// Returns these arguments; values that were not typed come from the run of `model`, if it has one.
    pub fn of_run(&self, model: &Path) -> Result<Self> {
        let Some(run) = Settings::for_model(model)? else { return Ok(self.clone()) };
        let ReadOptions { max_resolution, test_every, poses, masked_only } = run.read;
        let longest = (max_resolution > 0).then_some(max_resolution);
        Ok(Self {
            test_every: self.test_every.or(Some(test_every)),
            max_resolution: self.max_resolution.or(longest),
            masked_only: self.masked_only || masked_only,
            read: ReadArgs { poses: self.read.poses.or(Some(poses)), ..self.read.clone() },
            ..self.clone()
        })
    }

    /// Returns the flags that were typed, each after a space.
    pub fn to_flags(&self) -> String {
        let FileArgs { images, max_bad_photos, allow_outside } = &self.read.files;
        let typed = [
            ("test-every", self.test_every.map(|value| value.to_string())),
            ("max-resolution", self.max_resolution.map(|value| value.to_string())),
            ("ignore", self.ignore.as_deref().map(quoted_path)),
            ("images", images.as_deref().map(quoted_path)),
            ("max-bad-photos", max_bad_photos.map(|value| value.to_string())),
            ("allow-outside", allow_outside.then(String::new)),
            ("poses", self.read.poses.map(|value| value.to_string())),
        ];
        let flag = |(name, value): (&str, Option<String>)| value.map(|value| format!(" --{name} {value}"));
        typed.into_iter().filter_map(flag).map(|flag| flag.trim_end().to_owned()).collect()
    }

    /// Returns N where every N-th view is a test view; 0 for none.
    pub fn test_every(&self) -> u32 {
        self.test_every.unwrap_or(ReadOptions::default().test_every)
    }
}
