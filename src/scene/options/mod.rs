//! Options, each declared in one place: name, type, default, range, whether it may change within a run, and help.
//!
//! [`options!`](macro@crate::options) makes a struct from the declarations, with its `Default`, its check, its keys in
//! `config.toml` and, with the feature `cli`, what is typed: a flag, or `--set KEY=VALUE` for an option with the rule
//! `setting`. Flags have no default: only what is typed changes a value. So it wins over a file, and a file over the
//! default.

pub mod parse;
#[cfg(feature = "cli")]
pub mod typed;

use crate::error::{Error, Result, Setting};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

/// A range of valid values.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Range {
    Any,
    AtLeast(u32),
    NotNegative,
    Positive,
    UpTo(f64),
    PositiveUpTo(f64),
}

/// The description of an option.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name in `config.toml`; the flag has dashes instead of underscores.
    pub name: &'static str,
    /// True if it cannot change within a run, because the scene was read with it or buffers depend on it.
    pub is_fixed: bool,
    /// True if it has a flag; otherwise it is typed as `--set KEY=VALUE`.
    pub is_flag: bool,
    range: Range,
}

impl Key {
    /// Makes an option without a range.
    pub const fn new(name: &'static str) -> Self {
        Self { name, is_fixed: false, is_flag: true, range: Range::Any }
    }

    /// Leaves the flag to options that more people need.
    pub const fn setting(self) -> Self {
        Self { is_flag: false, ..self }
    }

    /// Forbids changes within a run.
    pub const fn fixed(self) -> Self {
        Self { is_fixed: true, ..self }
    }

    /// Accepts whole numbers from `least`.
    pub const fn at_least(self, least: u32) -> Self {
        Self { range: Range::AtLeast(least), ..self }
    }

    /// Accepts 0 or more.
    pub const fn not_negative(self) -> Self {
        Self { range: Range::NotNegative, ..self }
    }

    /// Accepts more than 0.
    pub const fn positive(self) -> Self {
        Self { range: Range::Positive, ..self }
    }

    /// Accepts 0 to `most`.
    pub const fn up_to(self, most: f64) -> Self {
        Self { range: Range::UpTo(most), ..self }
    }

    /// Accepts more than 0, at most `most`.
    pub const fn positive_up_to(self, most: f64) -> Self {
        Self { range: Range::PositiveUpTo(most), ..self }
    }

    /// Refuses a value outside of the range.
    pub fn check(&self, value: &impl Numbers) -> Result<()> {
        let is_wrong = |&number: &f64| match self.range {
            Range::Any => false,
            Range::AtLeast(least) => number < f64::from(least),
            // NaN is in no range.
            Range::NotNegative => !(0.0..=f64::MAX).contains(&number),
            Range::Positive => !(f64::MIN_POSITIVE..=f64::MAX).contains(&number),
            Range::UpTo(most) => !(0.0..=most).contains(&number),
            Range::PositiveUpTo(most) => !(f64::MIN_POSITIVE..=most).contains(&number),
        };
        let Some(wrong) = value.numbers().into_iter().find(is_wrong) else { return Ok(()) };
        let needed = self.range().unwrap_or_default();
        Err(Error::usage(Setting(self.name), format!("is {wrong}, needs {needed}")))
    }

    /// Returns the range in words; none if all values of the type are valid.
    pub fn range(&self) -> Option<String> {
        match self.range {
            Range::Any => None,
            Range::AtLeast(least) => Some(format!("at least {least}")),
            Range::NotNegative => Some("0 or more".to_owned()),
            Range::Positive => Some("more than 0".to_owned()),
            Range::UpTo(most) => Some(format!("0 to {most}")),
            Range::PositiveUpTo(most) => Some(format!("more than 0, at most {most}")),
        }
    }
}

/// Values with numbers that a range applies to.
pub trait Numbers {
    /// Returns these numbers; none for types without a range.
    fn numbers(&self) -> Vec<f64>;
}

macro_rules! numbers {
    ($($kind:ty => |$value:ident| $numbers:expr;)*) => {
        $(impl Numbers for $kind {
            fn numbers(&self) -> Vec<f64> {
                let $value = self;
                $numbers
            }
        })*
    };
}

numbers! {
    u32 => |value| vec![f64::from(*value)];
    u64 => |value| vec![*value as f64];
    f32 => |value| vec![f64::from(*value)];
    f64 => |value| vec![*value];
    [f32; 3] => |value| value.map(f64::from).to_vec();
    Option<u32> => |value| value.iter().map(|&number| f64::from(number)).collect();
    Option<f32> => |value| value.iter().map(|&number| f64::from(number)).collect();
    Option<f64> => |value| value.iter().copied().collect();
}

/// A struct made by [`options!`](macro@crate::options).
pub trait Options: Serialize + DeserializeOwned + Default {
    /// The options, in order.
    const KEYS: &'static [Key];

    /// Refuses values outside of their ranges; messages name the option.
    fn check_ranges(&self) -> Result<()>;

    /// Returns the values by key, in the syntax of the command line. Unset options are absent.
    fn texts(&self) -> BTreeMap<String, String> {
        // TOML prints f32 in the shortest form.
        let text = toml::to_string(self).unwrap_or_default();
        let fields = text.lines().filter_map(|line| line.split_once(" = "));
        fields.map(|(key, value)| (key.to_owned(), parse::as_typed(value))).collect()
    }
}

/// Declares a struct of options. A field is `NAME <"VALUE NAME">: TYPE = DEFAULT, RULES;` with rules of [`Key`] such as
/// `at_least(1)`, `fixed` and `setting`. Fields are grouped by the headings of their flags. The first paragraph of a field's doc
/// is the short help; `--help` also shows the rest.
#[macro_export]
macro_rules! options {
    ($(#[$outer:meta])* pub struct $name:ident {
        $($heading:literal { $(
            $(#[$meta:meta])* $key:ident <$value:literal>: $kind:ty = $default:expr $(, $rule:ident $(($bound:expr))?)*;
        )* })*
    }) => {
        $(#[$outer])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "cli", derive(clap::Args))]
        #[serde(default)]
        pub struct $name { $($(
            $(#[$meta])*
            #[cfg_attr(feature = "cli", arg(long, value_name = $value, help_heading = $heading))]
            pub $key: $kind,
        )*)* }

        impl Default for $name {
            fn default() -> Self {
                Self { $($($key: $default,)*)* }
            }
        }

        impl $crate::options::Options for $name {
            const KEYS: &'static [$crate::options::Key] =
                &[$($($crate::options::Key::new(stringify!($key))$(.$rule($($bound)?))*,)*)*];

            fn check_ranges(&self) -> $crate::Result<()> {
                let mut keys = Self::KEYS.iter();
                $($( $crate::options!(@check keys, self.$key $(, $rule)*); )*)*
                let _ = keys;
                Ok(())
            }
        }
    };
    // An option without rules accepts all values.
    (@check $keys:ident, $value:expr) => { let _ = $keys.next(); };
    (@check $keys:ident, $value:expr, fixed $(, $rule:ident)*) => {
        $crate::options!(@check $keys, $value $(, $rule)*);
    };
    (@check $keys:ident, $value:expr, setting) => { let _ = $keys.next(); };
    (@check $keys:ident, $value:expr, $($rule:ident),+) => {
        if let Some(key) = $keys.next() { key.check(&$value)?; }
    };
}
