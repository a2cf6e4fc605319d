//! Names of objects after a repair of masks with per-view ids.

use crate::files::label_table::{LabelTable, unique_name};
use crate::scene::LabelMap;
use std::collections::{BTreeMap, BTreeSet};

/// Returns the names of objects in repaired masks: the most frequent previous name among each object's pixels. `pairs`
/// are masks before and after. Names shared by several objects get numbers.
pub fn carried<'a>(
    known: &LabelTable,
    pairs: impl Iterator<Item = (&'a LabelMap, &'a LabelMap)>,
) -> BTreeMap<u16, String> {
    let names: BTreeSet<&str> = known.labels.iter().filter_map(|entry| entry.name.as_deref()).collect();
    let mut shared: BTreeMap<(u16, u16), u64> = BTreeMap::new();
    for (before, after) in pairs {
        for (&old, &new) in before.ids.iter().zip(&after.ids).filter(|(old, new)| **old != 0 && **new != 0) {
            *shared.entry((new, old)).or_default() += 1;
        }
    }
    let mut counts: BTreeMap<u16, BTreeMap<&str, u64>> = BTreeMap::new();
    for ((new, old), pixels) in shared {
        if let Some(name) = known.name(u32::from(old)) {
            *counts.entry(new).or_default().entry(without_number(name, &names)).or_default() += pixels;
        }
    }
    let mut taken = BTreeSet::new();
    let named = |(id, counts): (u16, BTreeMap<&str, u64>)| {
        let (most, _) = counts.into_iter().max_by_key(|&(_, pixels)| pixels)?;
        Some((id, unique_name(most.to_owned(), &mut taken)))
    };
    counts.into_iter().filter_map(named).collect()
}

/// Returns `cup` for `cup 2` if there is a `cup`: the number only distinguished masks within one photo.
fn without_number<'a>(name: &'a str, names: &BTreeSet<&str>) -> &'a str {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let bare = name.rsplit_once(' ').filter(|(_, number)| is_number(number)).map(|(bare, _)| bare);
    bare.filter(|bare| names.contains(bare)).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::LabelEntry;

    #[test]
    fn an_object_has_the_name_of_most_of_its_pixels() {
        let entry = |id, name: &str| LabelEntry { name: Some(name.to_owned()), ..LabelEntry::new(id) };
        let known = LabelTable::new(vec![entry(1, "cup"), entry(2, "cup 2"), entry(3, "box 7"), LabelEntry::new(4)]);
        let map = |ids: &[u16]| LabelMap { width: ids.len() as u32, height: 1, ids: ids.to_vec() };
        let pairs = [
            (map(&[1, 1, 2, 3, 3, 4, 0]), map(&[5, 5, 6, 7, 7, 8, 9])),
            (map(&[2, 2, 3, 3, 1, 1]), map(&[5, 5, 5, 7, 6, 0])),
        ];
        let names = carried(&known, pairs.iter().map(|(before, after)| (before, after)));
        let expected = [(5, "cup"), (6, "cup 2"), (7, "box 7")].map(|(id, name)| (id, name.to_owned()));
        assert_eq!(names, BTreeMap::from(expected));
    }
}
