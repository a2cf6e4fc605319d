//! The words of the terminal: the library names a setting by its field, as in `max_gaussians`; here it becomes the flag
//! `--max-gaussians`.

use super::command::Cli;
use crate::Error;
use clap::CommandFactory;
use std::collections::HashSet;
use std::sync::LazyLock;

/// Long flags of all commands, with `_` for `-` and without the leading dashes.
static FIELDS: LazyLock<HashSet<String>> = LazyLock::new(|| {
    fn collect(command: &clap::Command, found: &mut HashSet<String>) {
        found.extend(command.get_arguments().filter_map(|arg| arg.get_long()).map(|long| long.replace('-', "_")));
        command.get_subcommands().for_each(|command| collect(command, found));
    }
    let mut found = HashSet::new();
    collect(&Cli::command(), &mut found);
    found
});

/// Returns the flag of a field.
pub fn flag(field: &str) -> String {
    format!("--{}", field.replace('_', "-"))
}

/// Returns the message of an error with flags for fields.
pub(crate) fn error(error: &Error) -> String {
    match error {
        Error::Usage { argument, problem } if FIELDS.contains(argument) => {
            message(&format!("{}: {problem}", flag(argument)))
        }
        other => message(&other.to_string()),
    }
}

/// Replaces each `` `field` `` by `--flag` and each `` `field = value` `` by `--flag value`. Other text in backticks
/// stays.
pub(crate) fn message(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    let mut words = String::with_capacity(text.len());
    let mut index = 0;
    while index < parts.len() {
        words += parts[index];
        index += 1;
        // A closing backtick needs a part after it.
        if index + 1 < parts.len()
            && let Some(flag) = quoted(parts[index])
        {
            words += &flag;
            index += 1;
        } else if index < parts.len() {
            words.push('`');
        }
    }
    words
}

/// The flag, with its value, of the text between two backticks.
fn quoted(text: &str) -> Option<String> {
    let (field, value) = text.split_once(" = ").unwrap_or((text, ""));
    FIELDS.contains(field).then(|| format!("{} {value}", flag(field)).trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_become_flags() {
        for (text, expected) in [
            ("lower `max_gaussians` to 5 or `label_samples`", "lower --max-gaussians to 5 or --label-samples"),
            ("set `overlap = later`, then go on", "set --overlap later, then go on"),
            ("it has `red` and no `f_dc_0`; set `near`", "it has `red` and no `f_dc_0`; set --near"),
            ("a lone ` and `near`", "a lone ` and --near"),
            ("`near", "`near"),
            ("max_gaussians", "max_gaussians"),
            ("``", "``"),
            ("", ""),
        ] {
            assert_eq!(message(text), expected);
        }
    }

    #[test]
    fn arguments_become_flags() {
        assert_eq!(error(&Error::usage("test_every", "is 1; see `near`")), "--test-every: is 1; see --near");
        assert_eq!(error(&Error::usage("--row", "is empty")), "--row: is empty");
        assert_eq!(error(&Error::usage("LP_NUM_THREADS", "is -1")), "LP_NUM_THREADS: is -1");
        assert_eq!(error(&Error::data("a", "", "set `allow_outside`")), "a: set --allow-outside");
    }
}
