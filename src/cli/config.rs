//! From what was typed to what is done: flag before file before default.

use super::train_args::TrainArgs;
use crate::io::{self, LoadOptions};
use crate::train::config::{Occlusion, TrainConfig};
use crate::train::near::NEAR;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The configuration of a training run, checked.
pub fn decide(args: &TrainArgs) -> Result<TrainConfig> {
    let mut config = match &args.config {
        Some(path) => read(path)?,
        None if args.run.paper => TrainConfig::paper(),
        None => TrainConfig::default(),
    };
    args.apply(&mut config);
    config.check()?;
    check_occlusion(args, config.occlusion)?;
    Ok(config)
}

/// The source of the occluders and the files that it needs are typed apart.
fn check_occlusion(args: &TrainArgs, source: Occlusion) -> Result<()> {
    match (source, &args.depths, &args.occlusion_file) {
        (Occlusion::Depth, None, _) => Err(Error::usage("--occlusion", "depth needs the folder: --depths DIR")),
        (Occlusion::Depth, Some(_), _) => Ok(()),
        (_, Some(_), _) => Err(Error::usage("--depths", "is only read with --occlusion depth")),
        (Occlusion::File, _, None) => {
            Err(Error::usage("--config", "takes the occluders from a file; name it: --occlusion-file FILE"))
        }
        _ => Ok(()),
    }
}

/// Reads a configuration file; fields that it does not name keep their defaults.
pub fn read(path: &Path) -> Result<TrainConfig> {
    parse(path)
}

/// The near plane of a run by its configuration; other fields are nobody's business here.
pub fn near_of(path: &Path) -> Result<f32> {
    #[derive(serde::Deserialize)]
    struct Fields {
        near: Option<f32>,
    }
    // 0 leaves it to a scene, which is not known here.
    let near = parse::<Fields>(path)?.near.filter(|&near| near != 0.0).unwrap_or(NEAR);
    if !near.is_finite() || near < 0.0 {
        return Err(Error::data(path, "near", format!("is {near}, needs more than 0; or say --near")));
    }
    Ok(near)
}

fn parse<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T> {
    let text = io::read::text(path)?;
    toml::from_str(&text).map_err(|error| {
        let line = error.span().map(|span| text[..span.start].matches('\n').count() + 1);
        let place = line.map_or(String::new(), |line| format!("line {line}"));
        Error::data(path, place, error.message().replace('\n', " "))
    })
}

/// What ran, as a file that `--config` reads. Facts, such as the device, become comments.
pub fn dump(config: &TrainConfig, facts: &[(&str, String)]) -> Result<String> {
    let mut text = format!("# labelgs {}\n", env!("CARGO_PKG_VERSION"));
    for (name, value) in facts {
        text += &format!("# {name}: {}\n", value.replace('\n', " "));
    }
    let fields = toml::to_string(config).map_err(|error| Error::Bug(format!("configuration: {error}")))?;
    Ok(text + &fields)
}

/// How a training run reads its scene.
pub fn load_options(config: &TrainConfig, masks: Option<PathBuf>) -> LoadOptions {
    let some = |value: u32| (value > 0).then_some(value);
    LoadOptions {
        masks,
        max_resolution: some(config.max_resolution),
        test_every: some(config.test_every),
        background: config.background,
        photos: true,
        ..LoadOptions::default()
    }
}

/// Defaults of the flags of `train` as one types them, by flag without dashes.
pub fn default_texts() -> BTreeMap<String, String> {
    let mut texts = fields(&TrainConfig::default());
    for (flag, text) in [
        ("background", "black"),
        ("save-at", "none"),
        ("near", "0.2, less in a small scene"),
        ("feature-rest-lr", "--feature-lr / 20"),
    ] {
        texts.insert(flag.into(), text.into());
    }
    texts
}

/// Values of a configuration as one types them, by flag without dashes; what is not set has none.
pub fn fields(config: &TrainConfig) -> BTreeMap<String, String> {
    // TOML prints a f32 as one would type it.
    let fields = toml::to_string(config).unwrap_or_default();
    let fields = fields.lines().filter_map(|line| line.split_once(" = "));
    fields.map(|(name, value)| (name.replace('_', "-"), typed(value))).collect()
}

fn typed(value: &str) -> String {
    match value {
        "true" => "on".into(),
        "false" => "off".into(),
        _ => value.trim_matches('"').to_owned(),
    }
}
