//! Options as flags on the command line.

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use std::marker::PhantomData;

/// The flags of the options `T`, all optional.
#[derive(Clone, Debug)]
pub struct Typed<T> {
    matches: ArgMatches,
    options: PhantomData<T>,
}

impl<T: Args> Typed<T> {
    /// Applies the flags from the command line to `options`.
    pub fn apply(&self, options: &mut T) -> Result<(), clap::Error> {
        options.update_from_arg_matches(&self.matches)
    }
}

impl<T> Typed<T> {
    /// Returns true if the command line has the option with this key.
    pub fn is_typed(&self, key: &str) -> bool {
        self.matches.value_source(key) == Some(ValueSource::CommandLine)
    }
}

impl<T: Args> Args for Typed<T> {
    fn augment_args(command: Command) -> Command {
        T::augment_args_for_update(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        T::augment_args_for_update(command)
    }
}

impl<T: Args> FromArgMatches for Typed<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self { matches: matches.clone(), options: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.matches = matches.clone();
        Ok(())
    }
}
