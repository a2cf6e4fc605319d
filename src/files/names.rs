//! File names that match across systems.
//!
//! macOS decomposes accented letters, Windows ignores case, and programs there may spell names with another case than
//! the file has. After a folder is copied to Linux, such names no longer find their files.

use super::read;
use labelgs_scene::Result;
use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use unicode_normalization::UnicodeNormalization;

/// Maximum depth of folders; it also stops at links to a parent.
const DEPTH_MAX: usize = 8;

/// Most names in a message; `-v` prints all of them.
const SHOWN_MAX: usize = 4;

/// Returns the key by which two spellings of a name match: composed, in lower case.
pub fn folded(name: &str) -> String {
    name.nfc().collect::<String>().to_lowercase()
}

/// Joins the first few names for messages.
pub fn shortened(names: &[impl AsRef<str>]) -> String {
    let shown = names.iter().take(SHOWN_MAX).map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    if names.len() > SHOWN_MAX { format!("{shown}, ...") } else { shown }
}

/// Lists the files below a folder, sorted, as relative paths with `/`. Skips hidden files.
pub fn below(root: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    walk(root, "", 0, &mut found)?;
    found.sort();
    Ok(found)
}

fn walk(folder: &Path, prefix: &str, depth: usize, found: &mut Vec<String>) -> Result<()> {
    for path in read::folder(folder)? {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if name.starts_with('.') {
            continue;
        }
        if !path.is_dir() {
            found.push(format!("{prefix}{name}"));
        } else if depth < DEPTH_MAX {
            walk(&path, &format!("{prefix}{name}/"), depth + 1, found)?;
        }
    }
    Ok(())
}

/// Assigns each owner the first of its keys that is in `there`. An owner without one gets the only name in `there` that
/// matches a key of this owner alone.
pub fn claim(keys: &[Vec<String>], there: &BTreeSet<&str>) -> Vec<Option<String>> {
    let exact = |keys: &Vec<String>| keys.iter().find(|key| there.contains(key.as_str())).cloned();
    let mut found: Vec<Option<String>> = keys.iter().map(exact).collect();
    if found.iter().all(Option::is_some) {
        return found;
    }
    // The name of each key, or `None` if several names share the key.
    let mut by_key: HashMap<String, Option<&str>> = HashMap::new();
    for &name in there {
        by_key.entry(folded(name)).and_modify(|only| *only = None).or_insert(Some(name));
    }
    let mut owners: HashMap<String, usize> = HashMap::new();
    for keys in keys {
        let own: BTreeSet<String> = keys.iter().map(|key| folded(key)).collect();
        own.into_iter().for_each(|key| *owners.entry(key).or_default() += 1);
    }
    for (found, keys) in found.iter_mut().zip(keys).filter(|(found, _)| found.is_none()) {
        let mut own = keys.iter().filter(|key| owners.get(&folded(key)) == Some(&1));
        *found = own.find_map(|key| *by_key.get(&folded(key))?).map(str::to_owned);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_match_across_case_and_composition() {
        assert_eq!(folded("Cafe\u{301}.PNG"), folded("caf\u{e9}.png"));
        assert_ne!(folded("cafe.png"), folded("caf\u{e9}.png"));
    }

    #[test]
    fn a_name_belongs_to_the_owner_that_spells_it_so_or_to_the_only_one() {
        let keys = |names: &[&str]| names.iter().map(|&name| vec![name.to_owned()]).collect::<Vec<_>>();
        let claimed = |owners: &[&str], there: &[&str]| {
            let found = claim(&keys(owners), &there.iter().copied().collect());
            found.into_iter().map(Option::unwrap_or_default).collect::<Vec<_>>()
        };
        assert_eq!(claimed(&["A", "b"], &["a", "b"]), ["a", "b"]);
        assert_eq!(claimed(&["A", "a"], &["a"]), ["", "a"], "the other owner has its mask");
        assert_eq!(claimed(&["A", "\u{e9}"], &["a", "e\u{301}"]), ["a", "e\u{301}"]);
        assert_eq!(claimed(&["\u{dc}ber/a.png", "c.png"], &["u\u{308}ber/A.PNG"]), ["u\u{308}ber/A.PNG", ""]);
        assert_eq!(claimed(&["IMG"], &["Img", "img"]), [""], "two files match");
    }
}
