//! Settings in messages, under the name that the running program uses for them.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::sync::OnceLock;

/// The running command's name for each setting, by field: a flag, or `--set KEY`. Unset in programs that use the
/// library.
static SETTING_NAMES: OnceLock<BTreeMap<String, String>> = OnceLock::new();

/// Defines the names of settings in all later messages. Only the first call has an effect.
pub fn name_settings(flags: BTreeMap<String, String>) {
    // A second start in the same process, as in tests, keeps the first flags.
    let _ = SETTING_NAMES.set(flags);
}

/// A setting in a message, by the name of its field: `` `max_gaussians` ``. The command line prints what users can
/// type, such as `--max-gaussians` or `--set label_from`, if the running command has the setting, and `max gaussians`
/// otherwise.
///
/// Only a value of this type becomes a flag. Keys of files are plain text and never do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting(pub &'static str);

impl Setting {
    /// Formats the setting with a value: `` `overlap = later` `` or `--overlap later`.
    pub fn to(self, value: impl Display) -> String {
        self.named(SETTING_NAMES.get(), &format!(" = {value}"))
    }

    fn named(self, flags: Option<&BTreeMap<String, String>>, value: &str) -> String {
        let Self(field) = self;
        match flags.map(|flags| flags.get(field)) {
            None => format!("`{field}{value}`"),
            Some(Some(typed)) => {
                // A name of two words takes KEY=VALUE.
                let sign = if typed.contains(' ') { "=" } else { " " };
                format!("{typed}{}", value.replacen(" = ", sign, 1))
            }
            Some(None) => format!("{}{value}", field.replace('_', " ")),
        }
    }
}

impl Display for Setting {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        to.write_str(&self.named(SETTING_NAMES.get(), ""))
    }
}

/// A command in a message. The library knows no command line, so only the command line names it as it is typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verb(pub &'static str);

impl Verb {
    /// Formats the command with its arguments, in backticks: `labelgs photos PHOTOS -o SCENE`. In other programs it is
    /// the command's name alone.
    pub fn with(self, arguments: impl Display) -> String {
        self.typed(SETTING_NAMES.get().is_some(), &arguments.to_string())
    }

    fn typed(self, is_command_line: bool, arguments: &str) -> String {
        let Self(name) = self;
        if is_command_line {
            format!("`labelgs {name} {arguments}`")
        } else {
            format!("the command `{name}` of labelgs")
        }
    }
}

/// Formats the name without quotes, for the start of a message.
impl From<Setting> for String {
    fn from(setting: Setting) -> Self {
        setting.to_string().trim_matches('`').to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_a_flag_where_the_command_has_it() {
        let typed = [("max_gaussians", "--gaussians"), ("label_from", "--set label_from")];
        let flags = BTreeMap::from(typed.map(|(field, typed)| (field.to_owned(), typed.to_owned())));
        let (known, unknown) = (Setting("max_gaussians"), Setting("label_samples"));
        let of = |setting: Setting, value: &str| [None, Some(&flags)].map(|flags| setting.named(flags, value));
        assert_eq!(of(known, ""), ["`max_gaussians`", "--gaussians"]);
        assert_eq!(of(known, " = 5"), ["`max_gaussians = 5`", "--gaussians 5"]);
        assert_eq!(of(Setting("label_from"), "")[1], "--set label_from");
        assert_eq!(of(Setting("label_from"), " = 5")[1], "--set label_from=5");
        assert_eq!(of(unknown, ""), ["`label_samples`", "label samples"]);
        assert_eq!(of(unknown, " = 5"), ["`label_samples = 5`", "label samples = 5"]);
        assert_eq!(String::from(known), "max_gaussians", "at the head of a message");
    }

    #[test]
    fn a_command_is_typed_in_the_command_line_alone() {
        let of = |is_command_line| Verb("photos").typed(is_command_line, "DIR -o SCENE");
        assert_eq!([true, false].map(of), ["`labelgs photos DIR -o SCENE`", "the command `photos` of labelgs"]);
    }
}
