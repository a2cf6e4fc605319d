//! Options from the command line: flags, or `--set KEY=VALUE`.

use super::Options;
use super::parse::switch;
use clap::parser::ValueSource;
use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches};
use std::collections::BTreeMap;
use std::marker::PhantomData;

/// The options of `T` that the user typed.
#[derive(Clone, Debug)]
pub struct TypedOptions<T> {
    values: BTreeMap<&'static str, String>,
    options: PhantomData<T>,
}

impl<T: Args + Options> TypedOptions<T> {
    /// Applies typed values to `options`. Values in `sets` with keys of `T` are treated alike.
    pub fn apply(&self, options: &mut T, sets: &BTreeMap<String, String>) -> Result<(), clap::Error> {
        let sets = sets.iter().filter(|(key, _)| T::KEYS.iter().any(|known| known.name == key.as_str()));
        let sets = sets.map(|(key, value)| (key.as_str(), value.as_str()));
        parse(options, self.values.iter().map(|(key, value)| (*key, value.as_str())).chain(sets))
    }

    /// Returns true if the command line has the flag of this key.
    pub fn is_typed(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }
}

/// Parses values by key into `options`.
fn parse<'a, T: Args + Options>(
    options: &mut T,
    values: impl Iterator<Item = (&'a str, &'a str)>,
) -> Result<(), clap::Error> {
    let typed = values.map(|(key, value)| format!("--{}={value}", key.replace('_', "-")));
    options.update_from_arg_matches(&all::<T>().try_get_matches_from(typed)?)
}

/// Returns the error of a value that its option does not accept; `None` if it is accepted or `T` does not have the key.
pub fn refusal<T: Args + Options>(key: &str, value: &str) -> Option<clap::Error> {
    T::KEYS.iter().find(|known| known.name == key)?;
    parse(&mut T::default(), std::iter::once((key, value))).err()
}

/// Returns a command with each option of `T` as an argument.
pub fn all<T: Args + Options>() -> Command {
    let command = T::augment_args_for_update(Command::new("options").no_binary_name(true).disable_help_flag(true));
    let with_value = |command: Command, key: &'static str| {
        command.mut_arg(key, |arg| arg.action(ArgAction::Set).num_args(1).value_parser(switch))
    };
    switches::<T>().iter().fold(command, |command, key| with_value(command, key))
}

/// Returns the keys of options that are on or off.
fn switches<T: Options>() -> Vec<&'static str> {
    let defaults = T::default().texts();
    let is_switch = |key: &str| defaults.get(key).is_some_and(|text| text == "on" || text == "off");
    T::KEYS.iter().map(|key| key.name).filter(|key| is_switch(key)).collect()
}

impl<T: Args + Options> Args for TypedOptions<T> {
    /// A switch is a flag without a value, and turns on what is off by default.
    fn augment_args(command: Command) -> Command {
        let switches = switches::<T>();
        let flags = T::KEYS.iter().filter(|key| key.is_flag).map(|key| key.name);
        let options = all::<T>();
        flags.fold(command, |command, key| {
            let Some(flag) = options.get_arguments().find(|arg| arg.get_id() == key).cloned() else { return command };
            let is_switch = switches.contains(&key);
            command.arg(if is_switch { flag.action(ArgAction::SetTrue).num_args(0) } else { flag })
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<T: Args + Options> FromArgMatches for TypedOptions<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let typed = T::KEYS.iter().map(|key| (key.name, key.is_flag)).filter(|&(_, is_flag)| is_flag);
        let typed = typed.filter(|(key, _)| matches.value_source(key) == Some(ValueSource::CommandLine));
        let switches = switches::<T>();
        let value = |key: &str| {
            let parts = matches.get_raw(key).into_iter().flatten().map(|part| part.to_string_lossy());
            parts.collect::<Vec<_>>().join(",")
        };
        let text = |key: &str| if switches.contains(&key) { "on".to_owned() } else { value(key) };
        Ok(Self { values: typed.map(|(key, _)| (key, text(key))).collect(), options: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
