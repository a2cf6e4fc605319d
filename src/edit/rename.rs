//! Updates the table of labels after an edit of the model.

use super::catalogue::Catalogue;
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_scene::{Error, Result, Setting, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// Returns the entries with wanted ids.
pub fn keep(table: &LabelTable, wanted: impl Fn(u32) -> bool) -> LabelTable {
    LabelTable::new(table.labels.iter().filter(|entry| wanted(entry.id)).cloned().collect())
}

/// Returns the table after ids change. Of merged labels, the entry that already had the id gives name and colour, or
/// else the first one. Pixels add up; the number of views is the maximum, so that no mask counts twice.
pub fn renumber(table: &LabelTable, map: &BTreeMap<u32, u32>) -> LabelTable {
    let mut groups: BTreeMap<u32, Vec<&LabelEntry>> = BTreeMap::new();
    for entry in &table.labels {
        groups.entry(*map.get(&entry.id).unwrap_or(&entry.id)).or_default().push(entry);
    }
    groups.remove(&UNLABELLED);
    let merged = |(id, mut group): (u32, Vec<&LabelEntry>)| {
        group.sort_by_key(|entry| (entry.id != id, entry.id));
        LabelEntry {
            id,
            name: group.iter().find_map(|entry| entry.name.clone()),
            colour: group[0].colour,
            source: group.iter().find_map(|entry| entry.source.clone()),
            pixels: group.iter().map(|entry| entry.pixels).sum(),
            views: group.iter().map(|entry| entry.views).max().unwrap_or_default(),
            others: group[0].others.clone(),
        }
    };
    LabelTable::new(groups.into_iter().map(merged).collect())
}

/// Returns the table after a split. Parts of a named label are called `NAME 2`, `NAME 3` and so on.
pub fn split(table: &LabelTable, ids: &BTreeMap<u32, Vec<u32>>) -> LabelTable {
    let mut names: BTreeSet<String> = table.labels.iter().filter_map(|entry| entry.name.clone()).collect();
    let mut labels = table.labels.clone();
    for (&label, parts) in ids {
        let name = table.name(label).map(str::to_owned);
        let mut free = (2_u32..).filter_map(|number| {
            let name = format!("{} {number}", name.as_deref()?);
            names.insert(name.clone()).then_some(name)
        });
        for &id in &parts[1..] {
            let name = if name.is_some() { free.next() } else { None };
            labels.push(LabelEntry { name, ..LabelEntry::new(id) });
        }
    }
    LabelTable::new(labels)
}

/// Names a label, and creates the table if there is none. Errors if another label has the name.
pub fn give_name(known: &Catalogue, table: Option<LabelTable>, id: u32, name: &str) -> Result<LabelTable> {
    let made = || known.gaussians.keys().filter(|&&id| id != UNLABELLED).map(|&id| LabelEntry::new(id)).collect();
    let mut labels = table.map_or_else(made, |table| table.labels);
    if let Some(other) = labels.iter().find(|entry| entry.id != id && entry.name.as_deref() == Some(name)) {
        return Err(Error::usage(
            Setting("name"),
            format!("{name} is the name of label {}; names are unique", other.id),
        ));
    }
    match labels.iter_mut().find(|entry| entry.id == id) {
        Some(entry) => entry.name = Some(name.to_owned()),
        None => labels.push(LabelEntry { name: Some(name.to_owned()), ..LabelEntry::new(id) }),
    }
    Ok(LabelTable::new(labels))
}
