//! Settings of a training by key: `--set KEY=VALUE`, and the list of `--settings`.

use crate::cli::support::number_errors;
use crate::cli::support::setting_names::{flag, typed};
use crate::options::Key;
use crate::options::typed::{all, refusal};
use crate::run::{RunOptions, Settings};
use crate::scenes::ReadOptions;
use crate::train::{Preset, TrainConfig};
use crate::words::did_you_mean;
use crate::{Error, Result};
use clap::error::{ContextKind, ContextValue};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches};
use std::collections::BTreeMap;
use std::error::Error as _;

/// A setting and its value, as typed.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    key: &'static Key,
    value: String,
}

impl Assignment {
    /// Returns true if it sets the setting with this key.
    pub fn is_of(&self, key: &str) -> bool {
        self.key.name == key
    }
}

/// Parses `KEY=VALUE`. The key may be typed as a flag is.
pub(crate) fn assignment(text: &str) -> Result<Assignment, String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, such as label_weight=0.3")?;
    let key = find(key.trim())?;
    let value = value.trim();
    let refused = refusal::<ReadOptions>(key.name, value)
        .or_else(|| refusal::<TrainConfig>(key.name, value))
        .or_else(|| refusal::<RunOptions>(key.name, value));
    match refused {
        Some(error) => Err(problem(&error, value)),
        None => Ok(Assignment { key, value: value.to_owned() }),
    }
}

/// Finds a setting by its key or flag.
fn find(name: &str) -> Result<&'static Key, String> {
    let plain = name.trim_start_matches('-').replace('-', "_");
    Settings::keys().find(|key| key.name == plain).ok_or_else(|| {
        let cure = did_you_mean(&plain, Settings::keys().map(|key| key.name));
        let cure = cure.unwrap_or_else(|| "run `labelgs train --settings` to list all".to_owned());
        format!("there is no setting {name}; {cure}")
    })
}

/// Returns what is wrong with a value.
fn problem(error: &clap::Error, value: &str) -> String {
    if let Some(problem) = number_errors::number(error) {
        return format!("`{value}` {problem}");
    }
    match (error.get(ContextKind::ValidValue), error.source()) {
        (Some(ContextValue::Strings(valid)), _) => format!("`{value}` is not one of {}", valid.join(", ")),
        (_, Some(source)) => source.to_string(),
        _ => error.to_string(),
    }
}

/// Returns the values by key. Refuses a setting that was given twice. `is_typed` returns true for a key typed as a
/// flag.
pub(crate) fn by_key(sets: &[Assignment], is_typed: impl Fn(&str) -> bool) -> Result<BTreeMap<String, String>> {
    let mut values = BTreeMap::new();
    for Assignment { key, value } in sets {
        let given = format!("--set {}", key.name);
        if is_typed(key.name) {
            return Err(Error::usage(given, format!("{} sets it too; leave out one", flag(key.name))));
        }
        if values.insert(key.name.to_owned(), value.clone()).is_some() {
            return Err(Error::usage(given, "is given twice; leave out one"));
        }
    }
    Ok(values)
}

/// Returns the default of each setting that has one, by key.
fn defaults() -> BTreeMap<String, String> {
    let mut defaults = Settings::default().texts();
    // Defaults whose values need words.
    for (key, text) in [
        ("background", "black"),
        ("save_at", "none"),
        ("poses", "the convention of the format"),
        ("near", "0.2, less in a small scene"),
        ("max_gaussians", "by device memory"),
        ("budget", "by photos and steps"),
    ] {
        defaults.insert(key.into(), text.into());
    }
    defaults
}

/// Returns the arguments of all settings with their defaults in the help.
fn documented() -> Vec<(&'static Key, Arg)> {
    let defaults = defaults();
    let commands = [all::<ReadOptions>(), all::<TrainConfig>(), all::<RunOptions>()];
    let args: BTreeMap<String, &Arg> =
        commands.iter().flat_map(clap::Command::get_arguments).map(|arg| (arg.get_id().to_string(), arg)).collect();
    let keys = Settings::keys().filter_map(|key| args.get(key.name).map(|&arg| (key, arg.clone())));
    keys.map(|(key, arg)| (key, with_default(arg, defaults.get(key.name)))).collect()
}

fn with_default(arg: Arg, default: Option<&String>) -> Arg {
    let Some(default) = default else { return arg };
    let with = |help: String| format!("{help} [default: {default}]");
    let (short, long) = (arg.get_help().map(ToString::to_string), arg.get_long_help().map(ToString::to_string));
    let arg = if let Some(help) = short { arg.help(with(help)) } else { arg };
    if let Some(help) = long { arg.long_help(with(help)) } else { arg }
}

/// Settings of training that a newcomer needs: the help shows them with the flags that have no heading.
const PROMINENT_SETTINGS: [&str; 3] = ["iterations", "max_resolution", "preset"];

/// Returns the command `train` with defaults in its help.
pub(crate) fn in_help(train: clap::Command) -> clap::Command {
    let defaults = defaults();
    train.mut_args(|arg| {
        let arg = if PROMINENT_SETTINGS.contains(&arg.get_id().as_str()) { arg.help_heading(None) } else { arg };
        if arg.get_id() == "preset" {
            let help = arg.get_long_help().map(ToString::to_string).unwrap_or_default();
            return arg.long_help(format!("{help} {}", paper()));
        }
        let default = defaults.get(arg.get_id().as_str());
        with_default(arg, default)
    })
}

/// Returns the settings in which the paper differs from the defaults, as typed.
fn paper() -> String {
    let (paper, defaults) = (Settings::preset(Preset::Paper).texts(), Settings::default().texts());
    let changed = Settings::keys().filter_map(|key| {
        let value = paper.get(key.name).filter(|value| defaults.get(key.name) != Some(value))?;
        let sign = if key.is_flag { ' ' } else { '=' };
        Some(format!("{}{sign}{value}", typed(key)))
    });
    changed.collect::<Vec<_>>().join(" ")
}

/// Returns the key of `train --settings KEY`, none of it for all settings; nothing if a training was typed.
pub(crate) fn asked(train: &ArgMatches) -> Option<Option<&str>> {
    let is_typed = train.value_source("settings") == Some(ValueSource::CommandLine);
    is_typed.then(|| train.get_one::<String>("settings").map(String::as_str))
}

/// Returns the list of all settings, or all that is known of one.
pub(crate) fn list(only: Option<&str>) -> Result<String> {
    let documented = documented();
    let Some(name) = only else { return Ok(table(&documented)) };
    let key = find(name).map_err(|problem| Error::usage("--settings", problem))?;
    let Some((_, arg)) = documented.iter().find(|(known, _)| known.name == key.name) else {
        return Err(Error::Bug(format!("{name} has no help")));
    };
    let mut text = format!("{}\n", typed_with_value(key, arg));
    if let Some(values) = values(key, arg) {
        text += &format!("{values}\n");
    }
    if key.is_fixed {
        text += "cannot change within a run\n";
    }
    let help = arg.get_long_help().or_else(|| arg.get_help());
    text += &format!("\n{}\n", help.map(ToString::to_string).unwrap_or_default());
    for value in arg.get_possible_values() {
        text += &format!("  {}: {}\n", value.get_name(), value.get_help().map(ToString::to_string).unwrap_or_default());
    }
    Ok(text)
}

/// Returns what is typed for a setting.
fn typed_with_value(key: &Key, arg: &Arg) -> String {
    let value = arg.get_value_names().and_then(|names| names.first()).map(ToString::to_string).unwrap_or_default();
    match (key.is_flag, value == "SWITCH") {
        (true, true) => flag(key.name),
        (true, false) => format!("{} <{value}>", flag(key.name)),
        (false, _) => format!("--set {}=<{value}>", key.name),
    }
}

/// Returns the valid values in words.
fn values(key: &Key, arg: &Arg) -> Option<String> {
    let named: Vec<String> = arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
    let is_switch = arg.get_value_names().is_some_and(|names| names.iter().any(|name| name == "SWITCH"));
    match (named.is_empty(), is_switch) {
        (false, _) => Some(named.join(", ")),
        (true, true) => Some("on, off".to_owned()),
        (true, false) => key.range(),
    }
}

/// Returns a line for each setting, by heading.
fn table(documented: &[(&'static Key, Arg)]) -> String {
    let mut text = "Settings of `labelgs train`: flags, --set KEY=VALUE, or keys in a --config file.\n\
         Run `labelgs train --settings KEY` for details of a setting.\n"
        .to_owned();
    let mut headings: Vec<&str> = Vec::new();
    for heading in documented.iter().filter_map(|(_, arg)| arg.get_help_heading()) {
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    let width = documented.iter().map(|(key, arg)| typed_with_value(key, arg).len()).max().unwrap_or(0);
    for heading in headings {
        text += &format!("\n{heading}:\n");
        for (key, arg) in documented.iter().filter(|(_, arg)| arg.get_help_heading() == Some(heading)) {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            let values = values(key, arg).map_or(String::new(), |values| format!(" ({values})"));
            text += &format!("  {:<width$}  {help}{values}\n", typed_with_value(key, arg));
        }
    }
    text
}
