//! Names of files as they match on other systems.
//!
//! macOS decomposes letters with accents, Windows ignores case, and programs there write names in another case than
//! the file has. A folder that was copied to Linux then has files that are there and are not found.

use std::collections::HashMap;
use unicode_normalization::UnicodeNormalization;

/// Returns the key by which two spellings of one name match: composed, in lower case.
pub(crate) fn folded(name: &str) -> String {
    name.nfc().collect::<String>().to_lowercase()
}

/// The files of a folder, found by their name or, if no file has it, by the only name that matches.
#[derive(Debug, Default)]
pub(crate) struct Names {
    /// The name of each key; `None` if several files share the key.
    by_key: HashMap<String, Option<String>>,
}

impl Names {
    /// Returns the file that matches `name` alone.
    pub(crate) fn only(&self, name: &str) -> Option<&str> {
        self.by_key.get(&folded(name))?.as_deref()
    }
}

impl FromIterator<String> for Names {
    fn from_iter<T: IntoIterator<Item = String>>(names: T) -> Self {
        let mut by_key = HashMap::new();
        for name in names {
            by_key.entry(folded(&name)).and_modify(|only| *only = None).or_insert(Some(name));
        }
        Self { by_key }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_match_across_case_and_composition_where_one_file_has_them() {
        assert_eq!(folded("Cafe\u{301}.PNG"), folded("caf\u{e9}.png"));
        assert_ne!(folded("cafe.png"), folded("caf\u{e9}.png"));
        let names: Names = ["u\u{308}ber/A.PNG", "b.png", "B.png"].map(str::to_owned).into_iter().collect();
        assert_eq!(names.only("\u{dc}ber/a.png"), Some("u\u{308}ber/A.PNG"));
        assert_eq!(names.only("b.png"), None, "two files share the key");
        assert_eq!(names.only("c.png"), None);
    }
}
