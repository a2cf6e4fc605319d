//! Applies the labels found by strokes.

use crate::catalogue::Catalogue;
use crate::rename::give_name;
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_scene::{Error, Gaussians, Result, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// Gives the Gaussians the labels that a cut found, and names these labels. `found` has a label for each row, 0 for
/// none of `labels`. A row with 0 loses its label if it is one of `labels`; other labels stay. Changed rows have
/// confidence 1.
///
/// # Errors
///
/// A name that another label has.
pub fn claim(
    model: &Gaussians,
    table: Option<LabelTable>,
    found: &[u32],
    labels: &BTreeSet<u32>,
    names: &BTreeMap<u32, String>,
) -> Result<(Gaussians, LabelTable)> {
    if found.len() != model.len() {
        return Err(Error::Bug(format!("{} labels for {} Gaussians", found.len(), model.len())));
    }
    let mut model = model.clone();
    let before = model.labels.take().unwrap_or_else(|| vec![UNLABELLED; found.len()]);
    let after = |(&old, &new): (&u32, &u32)| if new == UNLABELLED && !labels.contains(&old) { old } else { new };
    let labelled: Vec<u32> = before.iter().zip(found).map(after).collect();
    if let Some(confidence) = &mut model.label_confidence {
        let changed = confidence.iter_mut().zip(before.iter().zip(&labelled)).filter(|(_, (old, new))| old != new);
        changed.for_each(|(share, _)| *share = 1.0);
    }
    let mut entries = table.map_or_else(Vec::new, |table| table.labels);
    let named: BTreeSet<u32> = entries.iter().map(|entry| entry.id).collect();
    let used: BTreeSet<u32> = labelled.iter().copied().filter(|&label| label != UNLABELLED).collect();
    entries.extend(used.difference(&named).map(|&id| LabelEntry::new(id)));
    let mut table = LabelTable::new(entries);
    for (&id, name) in names {
        table = give_name(&Catalogue::default(), Some(table), id, name)?;
    }
    Ok((Gaussians { labels: Some(labelled), ..model }, table))
}
