//! Finds the photo that an annotation tool's file refers to, whatever folder or server the tool read it from.

use labelgs_files::names::folded;
use std::collections::HashMap;
use std::path::Path;

/// Photos by the ends of their paths, as spelt and case-folded.
pub(super) struct PhotoIndex {
    spelt: Paths,
    folded: Paths,
}

struct Paths {
    /// Full names, with and without extension.
    whole: HashMap<String, Vec<usize>>,
    /// The same without one or more leading folders.
    ends: HashMap<String, Vec<usize>>,
}

/// Returns the name with and without its extension.
fn forms(name: &str) -> [String; 2] {
    [name.to_owned(), Path::new(name).with_extension("").to_string_lossy().into_owned()]
}

/// Returns the path without its first folder, without its first two, and so on.
fn tails(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('/').map(|(at, _)| &name[at + 1..])
}

impl Paths {
    fn new(photos: impl Iterator<Item = String>) -> Self {
        let mut index = Self { whole: HashMap::new(), ends: HashMap::new() };
        for (photo, name) in photos.enumerate() {
            let add = |map: &mut HashMap<String, Vec<usize>>, name: &str| {
                for key in forms(name) {
                    let photos = map.entry(key).or_default();
                    if photos.last() != Some(&photo) {
                        photos.push(photo);
                    }
                }
            };
            add(&mut index.whole, &name);
            tails(&name).for_each(|tail| add(&mut index.ends, tail));
        }
        index
    }

    fn find(&self, name: &str) -> Option<usize> {
        for name in std::iter::once(name).chain(tails(name)) {
            for map in [&self.whole, &self.ends] {
                for key in forms(name) {
                    if let Some([photo]) = map.get(&key).map(Vec::as_slice) {
                        return Some(*photo);
                    }
                }
            }
        }
        None
    }
}

impl PhotoIndex {
    /// Builds the index from the names of all photos.
    pub(super) fn new(photos: &[&str]) -> Self {
        let names = photos.iter().map(|name| name.replace('\\', "/"));
        Self { spelt: Paths::new(names.clone()), folded: Paths::new(names.map(|name| folded(&name))) }
    }

    /// Returns the photo of a path or address: the one with the full name, or the only one with the same end. Failing
    /// that, ignores the eight digits that Label Studio prepends to uploaded files.
    pub(super) fn find(&self, listed: &str) -> Option<usize> {
        let name = plain(listed);
        let own = self.find_plain(&name);
        own.or_else(|| {
            let (folder, file) = name.rsplit_once('/').map_or(("", name.as_str()), |(folder, file)| (folder, file));
            let (digits, file) = file.split_once('-')?;
            let is_prefix = digits.len() == 8 && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
            let name = if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") };
            is_prefix.then(|| self.find_plain(&name)).flatten()
        })
    }

    fn find_plain(&self, name: &str) -> Option<usize> {
        self.spelt.find(name).or_else(|| self.folded.find(&folded(name)))
    }
}

/// Extracts the path from an address or a Windows path: `/data/local-files/?d=a%20b.jpg` is `a b.jpg`.
fn plain(listed: &str) -> String {
    let listed = listed.replace('\\', "/");
    let path = match listed.split_once("?d=") {
        Some((_, path)) => path,
        None if listed.contains("://") => listed.split(['?', '#']).next().unwrap_or_default(),
        None => &listed,
    };
    if path.len() == listed.len() && !listed.starts_with("/data/") {
        return listed;
    }
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let [byte, after @ ..] = rest {
        let code = (*byte == b'%').then(|| std::str::from_utf8(after.get(..2)?).ok()).flatten();
        let code = code.and_then(|code| u8::from_str_radix(code, 16).ok());
        bytes.push(code.unwrap_or(*byte));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photos_are_found_by_paths_of_other_machines() {
        let index = PhotoIndex::new(&["left/a.png", "right/a.png", "b 1.jpg", "12345678-c.jpg", "d.e.jpg"]);
        for (listed, expected) in [
            ("left/a.png", Some(0)),
            ("images/right/a.JPG", Some(1)),
            ("a.png", None),
            ("C:\\photos\\left\\a.png", Some(0)),
            ("b 1.png", Some(2)),
            ("/data/upload/7/0a1b2c3d-b%201.jpg", Some(2)),
            ("/data/local-files/?d=set%2Fb 1.jpg", Some(2)),
            ("https://host/set/b%201.jpg?x=1#y", Some(2)),
            ("12345678-c.jpg", Some(3)),
            ("images/12345678-12345678-c.jpg", Some(3)),
            ("d.e.png", Some(4)),
            ("LEFT/A.PNG", Some(0)),
            ("12345678-", None),
            ("100%.png", None),
            ("", None),
        ] {
            assert_eq!(index.find(listed), expected, "{listed}");
        }
    }
}
