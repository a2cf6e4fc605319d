//! All settings of a run, and their file.

use super::every::Every;
use crate::error::{Error, Result, Setting};
use crate::files::{self, run_folder};
use crate::options::parse::as_bytes;
#[cfg(feature = "cli")]
use crate::options::parse::bytes;
use crate::options::{Key, Options};
use crate::scenes::{self, LoadOptions, ReadOptions};
use crate::train::setup::near_plane::NEAR_DEFAULT;
use crate::train::{ExposureMode, Preset, TrainConfig};
use crate::words::did_you_mean;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

crate::options! {
    /// Settings for intermediate outputs and photo memory. They do not affect results.
    pub struct RunOptions {
        "Output" {
            /// Extra steps after which to save the model, comma-separated.
            #[cfg_attr(feature = "cli", arg(value_delimiter = ','))]
            save_at <"LIST">: Vec<u32> = Vec::new(), setting;

            /// Time between two preview images, such as 10min, or a number of steps; 0 makes none.
            ///
            /// Previews show the first held-out view.
            preview_every <"TIME">: Every = Every::Minutes(10.0), setting;

            /// Time between two checkpoints, such as 10min, or a number of steps; 0 writes one only on interruption.
            ///
            /// A checkpoint is also written after the last step. --resume continues from the newest checkpoint.
            checkpoint_every <"TIME">: Every = Every::Minutes(10.0);
        }
        "Scene" {
            /// Host memory for photos and masks, such as 800M or 4G.
            ///
            /// If the scene needs more, the rest goes to a temporary file in OUT, decoded and resized for training. The
            /// file is deleted on exit. The result does not depend on this setting.
            #[cfg_attr(feature = "cli", arg(value_parser = bytes))]
            #[serde(with = "as_bytes")]
            photo_memory <"SIZE">: u64 = scenes::PHOTO_MEMORY;
        }
    }
}

/// The settings of a run, in three parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How to read the scene.
    pub read: ReadOptions,
    /// How to train.
    pub train: TrainConfig,
    /// What the run writes before it ends.
    pub run: RunOptions,
}

impl Settings {
    /// Returns the settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        Self { train: TrainConfig::preset(preset), ..Self::default() }
    }

    /// Returns every option, in file order.
    pub fn keys() -> impl Iterator<Item = &'static Key> {
        ReadOptions::KEYS.iter().chain(TrainConfig::KEYS).chain(RunOptions::KEYS)
    }

    /// Returns the values by key, in the syntax of the command line. Unset options are absent.
    pub fn texts(&self) -> BTreeMap<String, String> {
        self.read.texts().into_iter().chain(self.train.texts()).chain(self.run.texts()).collect()
    }

    /// Sets dependent settings: objects alone have no background and no sky.
    pub(super) fn settled(mut self) -> Self {
        if self.read.masked_only {
            self.train.random_background = true;
            self.train.far_points = 0;
        }
        self
    }

    /// Refuses invalid values; messages name the option.
    pub fn check(&self) -> Result<()> {
        self.read.check()?;
        if self.read.masked_only && self.train.exposure == ExposureMode::On {
            let problem =
                format!("is on, which needs {}: a random background has no exposure", Setting("exposure").to("off"));
            return Err(Error::usage(Setting("masked_only"), problem));
        }
        self.train.check()?;
        self.run.check_ranges()
    }

    /// Reads a file that [`Self::dump`] wrote. Missing keys keep their defaults.
    pub fn read(path: &Path) -> Result<Self> {
        let text = files::read::text(path)?;
        let named: BTreeMap<toml::Spanned<String>, IgnoredAny> = parse(path, &text)?;
        if let Some(key) = named.keys().find(|key| !Self::keys().any(|known| known.name == key.get_ref())) {
            let cure = did_you_mean(key.get_ref(), Self::keys().map(|known| known.name));
            let cure = cure.unwrap_or_else(|| "config.toml of any run lists all settings".to_owned());
            let problem = format!("there is no setting {}; {cure}", key.get_ref());
            return Err(Error::data(path, line(&text, key.span().start), problem));
        }
        Self::parse(path, &text)
    }

    /// Parses the keys of each part. A part ignores keys of other parts.
    fn parse(path: &Path, text: &str) -> Result<Self> {
        Ok(Self { read: parse(path, text)?, train: parse(path, text)?, run: parse(path, text)? })
    }

    /// Reads the settings of the run that a model belongs to. Returns `None` if the model is not in a run folder.
    pub fn for_model(model: &Path) -> Result<Option<Self>> {
        let file = run_folder::find_for_model(model)
            .map(|run| run.join(run_folder::CONFIG_FILE))
            .filter(|file| file.is_file());
        let Some(file) = file else { return Ok(None) };
        // Accept keys of other labelgs versions: they must not make a model unreadable.
        let text = files::read::text(&file)?;
        let mut settings = Self::parse(&file, &text)?;
        let near = &mut settings.train.near;
        // 0 means automatic, which needs the scene.
        if *near == 0.0 {
            *near = NEAR_DEFAULT;
        }
        if !near.is_finite() || *near < 0.0 {
            let problem = format!("is {near}, but must be above 0; fix it, or set {}", Setting("near"));
            return Err(Error::data(&file, "near", problem));
        }
        Ok(Some(settings))
    }

    /// Returns the text for [`Self::read`]. Facts, such as the device, become comments.
    pub fn dump(&self, facts: &[(&str, String)]) -> Result<String> {
        let mut text = format!("# labelgs {}\n", env!("CARGO_PKG_VERSION"));
        for (name, value) in facts {
            text += &format!("# {name}: {}\n", value.replace('\n', " "));
        }
        let bug = |error| Error::Bug(format!("configuration: {error}"));
        text += &toml::to_string(&self.read).map_err(bug)?;
        text += &toml::to_string(&self.train).map_err(bug)?;
        text += &toml::to_string(&self.run).map_err(bug)?;
        Ok(text)
    }

    /// Returns the options for reading the scene.
    pub fn load_options(&self, masks: Option<PathBuf>) -> LoadOptions {
        let some = |value: u32| (value > 0).then_some(value);
        LoadOptions {
            masks,
            max_resolution: some(self.read.max_resolution),
            test_every: some(self.read.test_every),
            background: self.train.background,
            keep_opacity: self.train.random_background,
            masked_only: self.read.masked_only,
            cut: self.read.masked_only,
            photos: true,
            photo_memory: self.run.photo_memory,
            ..LoadOptions::default()
        }
    }
}

fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T> {
    toml::from_str(text).map_err(|error| {
        let place = error.span().map_or(String::new(), |span| line(text, span.start));
        Error::data(path, place, error.message().replace('\n', " "))
    })
}

fn line(text: &str, at: usize) -> String {
    format!("line {}", text[..at].matches('\n').count() + 1)
}
