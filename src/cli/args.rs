//! Arguments that several verbs share. Only what was typed is in here; decisions are made in `config` and in the verbs.

use super::values::share;
use crate::Result;
use crate::io::{LoadOptions, ReadOptions};
use crate::run::Settings;
use clap::Args;
use std::path::Path;

/// What applies to every verb.
#[derive(Args, Clone, Debug, Default)]
pub struct GlobalArgs {
    /// Say nothing but errors.
    #[arg(short, long, global = true, help_heading = "Output", conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more; twice for everything. RUST_LOG wins.
    #[arg(short, long, global = true, help_heading = "Output", action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Vulkan device: its number or UUID as `labelgs devices` prints them, or a part of its name; otherwise
    /// LABELGS_DEVICE, otherwise the fastest kind.
    #[arg(long, value_name = "DEVICE", global = true, help_heading = "Device")]
    pub device: Option<String>,
}

/// `--json` of a verb that prints its result.
#[derive(Args, Clone, Debug, Default)]
pub struct JsonFlag {
    /// Print the result as JSON.
    #[arg(id = "json_here", long = "json", help_heading = "Output")]
    pub json: bool,
}

/// What is let through of a scene that is not as it should be.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Scene")]
pub struct ReadArgs {
    /// Largest share of the photos, from 0 to 1, that may be undecodable: they are skipped with a warning.
    /// 0.1 unless given.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub max_bad_photos: Option<f32>,
    /// Read photos and points also where the scene lists them outside of its folder.
    #[arg(long)]
    pub allow_outside: bool,
}

impl ReadArgs {
    /// Puts what was typed into `options`.
    pub fn into_options(self, options: LoadOptions) -> LoadOptions {
        let max_bad_photos = self.max_bad_photos.unwrap_or(options.max_bad_photos);
        LoadOptions { max_bad_photos, allow_outside: self.allow_outside || options.allow_outside, ..options }
    }
}

/// How a scene is read by a verb that does not train.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArgs {
    /// Every N-th view by name is a test view, 0 for none; otherwise 8, and as in the run of the model for `eval` and
    /// `render`.
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub test_every: Option<u32>,
    /// Longest side of a picture, px; otherwise its own size, and as in the run of the model for `eval` and `render`.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Scene")]
    pub max_resolution: Option<u32>,
    /// What is let through.
    #[command(flatten)]
    pub read: ReadArgs,
}

impl SceneArgs {
    /// The same, with the values of the run that a model is in where nothing was typed.
    pub fn of_run(&self, model: &Path) -> Result<Self> {
        let Some(ReadOptions { max_resolution, test_every }) = Settings::of_model(model)?.map(|run| run.read) else {
            return Ok(self.clone());
        };
        let longest = (max_resolution > 0).then_some(max_resolution);
        Ok(Self {
            test_every: self.test_every.or(Some(test_every)),
            max_resolution: self.max_resolution.or(longest),
            ..self.clone()
        })
    }

    /// Every how many-th view is a test view, 0 for none.
    pub fn test_every(&self) -> u32 {
        self.test_every.unwrap_or(ReadOptions::default().test_every)
    }
}
