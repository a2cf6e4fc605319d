//! A new label for some Gaussians.

use super::catalogue::Catalogue;
use super::merge::MergedLabels;
use super::rename::give_name;
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_scene::{Error, Gaussians, MODEL_LABEL_MAX, Result, Setting, UNLABELLED};

/// Gives the Gaussians of some rows a new label: the id after the last one of the model and its table. Their confidence
/// is 1; all other Gaussians keep their labels.
pub fn add(model: &Gaussians, table: Option<LabelTable>, rows: &[bool], name: Option<&str>) -> Result<MergedLabels> {
    if rows.len() != model.len() {
        return Err(Error::Bug(format!("{} rows for {} Gaussians", rows.len(), model.len())));
    }
    let mut model = model.clone();
    let labels = model.labels.get_or_insert_with(|| vec![UNLABELLED; rows.len()]);
    let entries = table.iter().flat_map(|table| &table.labels).map(|entry| entry.id);
    let into = labels.iter().copied().chain(entries).max().unwrap_or(UNLABELLED) + 1;
    if into > MODEL_LABEL_MAX {
        return Err(Error::usage(Setting("labels"), format!("no id is free up to {MODEL_LABEL_MAX}")));
    }
    labels.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(label, _)| *label = into);
    if let Some(confidence) = &mut model.label_confidence {
        confidence.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(share, _)| *share = 1.0);
    }
    let mut entries = table.map_or_else(Vec::new, |table| table.labels);
    entries.push(LabelEntry::new(into));
    let mut table = LabelTable::new(entries);
    if let Some(name) = name {
        table = give_name(&Catalogue::default(), Some(table), into, name)?;
    }
    Ok(MergedLabels { model, table: Some(table), into })
}
