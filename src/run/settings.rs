//! Everything that is decided about a run, and the file that keeps it.

use crate::error::{Error, Result};
use crate::io::{self, LoadOptions, ReadOptions, run_folder};
use crate::options::{Key, Options};
use crate::train::TrainConfig;
use crate::train::near::NEAR;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

crate::options::options! {
    /// What a run writes on its way.
    pub struct RunOptions {
        "Output" {
            /// Steps after which to save the model too, with commas between.
            #[cfg_attr(feature = "cli", arg(value_delimiter = ','))]
            save_at <"LIST">: Vec<u32> = Vec::new();

            /// Steps between two preview pictures; 0 makes none.
            ///
            /// They show the first held-out view.
            preview_every <"N">: u32 = 1000;

            /// Steps between two checkpoints; 0 writes one when interrupted only.
            ///
            /// A run goes on from its newest checkpoint with --resume.
            checkpoint_every <"N">: u32 = 1000;
        }
    }
}

/// The options of a run, in three parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// How the scene is read.
    pub read: ReadOptions,
    /// What the training does.
    pub train: TrainConfig,
    /// What is written on the way.
    pub run: RunOptions,
}

impl Settings {
    /// The paper's settings where they differ from the default.
    pub fn paper() -> Self {
        Self { train: TrainConfig::paper(), ..Self::default() }
    }

    /// Every option, in the order of the file.
    pub fn keys() -> impl Iterator<Item = &'static Key> {
        ReadOptions::KEYS.iter().chain(TrainConfig::KEYS).chain(RunOptions::KEYS)
    }

    /// The values as one types them, by key; an option that is not set has none.
    pub fn texts(&self) -> BTreeMap<String, String> {
        self.read.texts().into_iter().chain(self.train.texts()).chain(self.run.texts()).collect()
    }

    /// Refuses values that make no sense; messages name the option.
    pub fn check(&self) -> Result<()> {
        self.read.check()?;
        self.train.check()?;
        self.run.check_ranges()
    }

    /// Reads a file as [`Self::dump`] writes it; what it does not name keeps its default.
    pub fn read(path: &Path) -> Result<Self> {
        let text = io::read::text(path)?;
        let named: BTreeMap<toml::Spanned<String>, IgnoredAny> = parse(path, &text)?;
        if let Some(key) = named.keys().find(|key| !Self::keys().any(|known| known.name == key.get_ref())) {
            let problem = format!("there is no setting {}; config.toml of any run lists all", key.get_ref());
            return Err(Error::data(path, line(&text, key.span().start), problem));
        }
        Self::parse(path, &text)
    }

    /// Each part takes its own keys and leaves the others alone.
    fn parse(path: &Path, text: &str) -> Result<Self> {
        Ok(Self { read: parse(path, text)?, train: parse(path, text)?, run: parse(path, text)? })
    }

    /// The settings of the run that a model is in, if it is in one; its folder is that of
    /// [`run_folder::of_model`].
    pub fn of_model(model: &Path) -> Result<Option<Self>> {
        let file = run_folder::of_model(model).map(|run| run.join(run_folder::CONFIG)).filter(|file| file.is_file());
        let Some(file) = file else { return Ok(None) };
        // Rows that other versions of the program know are no reason to refuse a model.
        let text = io::read::text(&file)?;
        let mut settings = Self::parse(&file, &text)?;
        let near = &mut settings.train.near;
        // 0 leaves it to a scene, which is not known here.
        if *near == 0.0 {
            *near = NEAR;
        }
        if !near.is_finite() || *near < 0.0 {
            return Err(Error::data(&file, "near", format!("is {near}, needs more than 0; correct it or set `near`")));
        }
        Ok(Some(settings))
    }

    /// The file that [`Self::read`] reads. Facts, such as the device, become comments.
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

    /// How the run reads its scene.
    pub fn load_options(&self, masks: Option<PathBuf>) -> LoadOptions {
        let some = |value: u32| (value > 0).then_some(value);
        LoadOptions {
            masks,
            max_resolution: some(self.read.max_resolution),
            test_every: some(self.read.test_every),
            background: self.train.background,
            photos: true,
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
