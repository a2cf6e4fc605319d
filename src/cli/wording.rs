//! Names of flags.

use clap::{ArgMatches, Command};
use std::collections::BTreeMap;

/// Returns the flag of a field.
pub fn flag(field: &str) -> String {
    format!("--{}", field.replace('_', "-"))
}

/// Returns the flags that were open to what was typed, by the field that each sets. A hidden alias is a field's name in
/// other commands.
pub(crate) fn flags(root: &Command, typed: &ArgMatches) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let (mut command, mut typed) = (root, Some(typed));
    loop {
        for arg in command.get_arguments() {
            let Some(long) = arg.get_long() else { continue };
            let names = arg.get_all_aliases().unwrap_or_default().into_iter().chain([long]);
            found.extend(names.map(|name| (name.replace('-', "_"), format!("--{long}"))));
        }
        // Flags of a training follow those of `ablate`, after `--`.
        let next = typed.and_then(ArgMatches::subcommand).map(|(name, typed)| (name, Some(typed)));
        let next = next.or((command.get_name() == "ablate").then_some(("train", None)));
        let Some((name, rest)) = next else { return found };
        let Some(inner) = command.find_subcommand(name).or_else(|| root.find_subcommand(name)) else { return found };
        (command, typed) = (inner, rest);
    }
}
