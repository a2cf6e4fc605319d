//! Several labels become one, or one gets a name.

use super::catalogue::Catalogue;
use super::change::relabel;
use super::rename::{give_name, renumber};
use labelgs_files::label_table::LabelTable;
use labelgs_scene::{Error, Gaussians, Result, Setting, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// The result of [`merge`].
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// The model with its new labels.
    pub model: Gaussians,
    /// The names of its labels, if there are names.
    pub table: Option<LabelTable>,
    /// The label that the others became.
    pub into: u32,
}

/// Merges labels into one: `into`, which is one of them or a free id, else the smallest of them. It gets `name`, else
/// the name of the label with that id, or the first name among the others.
pub fn merge(
    model: &Gaussians,
    known: &Catalogue,
    labels: &BTreeSet<u32>,
    into: Option<u32>,
    name: Option<&str>,
) -> Result<Merged> {
    let smallest = labels.iter().copied().find(|&label| label != UNLABELLED);
    let into = match into.or(smallest) {
        Some(UNLABELLED) | None => {
            return Err(Error::usage(Setting("into"), "0 means no label; relabelling removes labels"));
        }
        Some(into) => into,
    };
    if known.gaussians.contains_key(&into) && !labels.contains(&into) {
        let problem =
            format!("label {} is another one; add it to {}, or choose a free id", known.title(into), Setting("labels"));
        return Err(Error::usage(Setting("into"), problem));
    }
    let map: BTreeMap<u32, u32> = labels.iter().map(|&label| (label, into)).collect();
    let merged = relabel(model, &map);
    let mut table = known.table.as_ref().map(|table| renumber(table, &map));
    if let Some(name) = name {
        table = Some(give_name(&Catalogue::new(&merged, None), table, into, name)?);
    }
    Ok(Merged { model: merged, table, into })
}
