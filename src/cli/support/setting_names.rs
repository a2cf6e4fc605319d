//! Names of settings on the command line.

use crate::options::Key;
use crate::run::Settings;
use clap::{ArgMatches, Command};
use std::collections::BTreeMap;

/// Returns the flag of a field.
pub fn flag(field: &str) -> String {
    format!("--{}", field.replace('_', "-"))
}

/// Returns what is typed for a setting of a training, before its value.
pub(crate) fn typed(key: &Key) -> String {
    if key.is_flag { flag(key.name) } else { format!("--set {}", key.name) }
}

/// Returns what was open to be typed, by the field that it sets: flags, and settings where there is `--set`. A hidden
/// alias is a field's name in other commands.
pub(crate) fn names(root: &Command, typed_words: &ArgMatches) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let (mut command, mut words) = (root, Some(typed_words));
    loop {
        if command.get_arguments().any(|arg| arg.get_long() == Some("set")) {
            found.extend(Settings::keys().map(|key| (key.name.to_owned(), typed(key))));
        }
        for arg in command.get_arguments() {
            let Some(long) = arg.get_long() else { continue };
            let names = arg.get_all_aliases().unwrap_or_default().into_iter().chain([long]);
            found.extend(names.map(|name| (name.replace('-', "_"), format!("--{long}"))));
        }
        // Flags of a training follow those of `ablate`, after `--`.
        let next = words.and_then(ArgMatches::subcommand).map(|(name, words)| (name, Some(words)));
        let next = next.or((command.get_name() == "ablate").then_some(("train", None)));
        let Some((name, rest)) = next else { return found };
        let Some(inner) = command.find_subcommand(name).or_else(|| root.find_subcommand(name)) else { return found };
        (command, words) = (inner, rest);
    }
}
