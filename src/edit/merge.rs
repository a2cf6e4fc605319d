//! Merges labels, or names one.

use super::catalogue::Catalogue;
use super::change::relabel;
use super::rename::{give_name, renumber};
use labelgs_files::label_table::LabelTable;
use labelgs_scene::{Error, Gaussians, Result, Setting, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// The result of [`merge`].
#[derive(Clone, Debug, PartialEq)]
pub struct MergedLabels {
    /// The model with its new labels.
    pub model: Gaussians,
    /// The names of its labels, if there are any.
    pub table: Option<LabelTable>,
    /// The label that results.
    pub into: u32,
}

/// Merges labels into `into`, which is one of them or a free id, or by default into the smallest. The result is called
/// `name`, or else keeps the name of that id, or else gets the first name among the others.
pub fn merge(
    model: &Gaussians,
    known: &Catalogue,
    labels: &BTreeSet<u32>,
    into: Option<u32>,
    name: Option<&str>,
) -> Result<MergedLabels> {
    let smallest = labels.iter().copied().find(|&label| label != UNLABELLED);
    let into = match into.or(smallest) {
        Some(UNLABELLED) | None => {
            return Err(Error::usage(Setting("into"), "0 means no label; use relabel to remove labels"));
        }
        Some(into) => into,
    };
    if known.gaussians.contains_key(&into) && !labels.contains(&into) {
        let problem = format!(
            "label {} is not one of them; add it to {}, or choose a free id",
            known.title(into),
            Setting("labels")
        );
        return Err(Error::usage(Setting("into"), problem));
    }
    let map: BTreeMap<u32, u32> = labels.iter().map(|&label| (label, into)).collect();
    let merged = relabel(model, &map);
    let mut table = known.table.as_ref().map(|table| renumber(table, &map));
    if let Some(name) = name {
        table = Some(give_name(&Catalogue::new(&merged, None), table, into, name)?);
    }
    Ok(MergedLabels { model: merged, table, into })
}
