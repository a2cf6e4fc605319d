//! The labels of a model by id and by name, for command lines and messages.

use labelgs_files::label_table::LabelTable;
use labelgs_scene::words::did_you_mean;
use labelgs_scene::{Error, Gaussians, Result, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// Most labels listed in a message.
const LISTED_MAX: usize = 6;

/// A choice of labels on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pick {
    /// All ids from the first to the last, both included.
    Ids(u32, u32),
    /// The label with this name, ignoring case.
    Name(String),
}

/// The labels of a model with their counts and names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Catalogue {
    /// Number of Gaussians per label in the model, 0 included.
    pub gaussians: BTreeMap<u32, u64>,
    /// Names and pixel counts, if there is a table.
    pub table: Option<LabelTable>,
}

impl Catalogue {
    /// Counts the labels of a model. Without labels all Gaussians have label 0.
    pub fn new(model: &Gaussians, table: Option<LabelTable>) -> Self {
        let mut gaussians = BTreeMap::new();
        match &model.labels {
            Some(labels) => labels.iter().for_each(|&label| *gaussians.entry(label).or_insert(0) += 1),
            None if model.is_empty() => {}
            None => drop(gaussians.insert(UNLABELLED, model.len() as u64)),
        }
        Self { gaussians, table }
    }

    /// Returns the ids of `picks`; each must occur in the model. Errors name `argument` and list the known labels.
    pub fn resolve(&self, argument: &str, picks: &[Pick]) -> Result<BTreeSet<u32>> {
        let mut ids = BTreeSet::new();
        for pick in picks {
            match pick {
                // Of a long range, check only as many ids as there are labels, plus those that a message lists.
                Pick::Ids(first, last) => {
                    ids.extend((*first..=*last).take(self.gaussians.len() + LISTED_MAX + 1));
                }
                Pick::Name(name) => {
                    let found = self.table.as_ref().and_then(|table| table.id_of(name));
                    ids.insert(found.ok_or_else(|| Error::usage(argument, self.unknown_name(name)))?);
                }
            }
        }
        self.check(argument, &ids)?;
        Ok(ids)
    }

    /// Refuses an empty choice and labels without a Gaussian.
    pub fn check(&self, argument: &str, ids: &BTreeSet<u32>) -> Result<()> {
        let unknown: Vec<String> =
            ids.iter().filter(|id| !self.gaussians.contains_key(id)).map(|&id| self.title(id)).collect();
        if ids.is_empty() {
            return Err(Error::usage(argument, format!("names no label; {}", self.describe())));
        }
        if !unknown.is_empty() {
            let some = unknown.iter().take(LISTED_MAX).map(String::as_str).collect::<Vec<_>>().join(", ");
            return Err(Error::usage(argument, format!("no Gaussian has label {some}; {}", self.describe())));
        }
        Ok(())
    }

    /// Returns the name of a label, if it has one.
    pub fn name(&self, id: u32) -> Option<&str> {
        self.table.as_ref()?.name(id)
    }

    /// Returns the id and, if there is one, the name: `3 cup`.
    pub fn title(&self, id: u32) -> String {
        self.name(id).map_or_else(|| id.to_string(), |name| format!("{id} {name}"))
    }

    /// Returns the message for an unknown name.
    fn unknown_name(&self, name: &str) -> String {
        let names = self.table.iter().flat_map(|table| &table.labels).filter_map(|entry| entry.name.as_deref());
        let cure = did_you_mean(name, names).unwrap_or_else(|| self.describe());
        format!("no label is named {name}; {cure}")
    }

    /// Returns a few of the labels for messages: "the model has 1 cup, 3, 4 barrel and 12 more".
    pub fn describe(&self) -> String {
        let objects = self.gaussians.keys().filter(|id| **id != UNLABELLED);
        let texts: Vec<String> = objects.clone().take(LISTED_MAX).map(|&id| self.title(id)).collect();
        if texts.is_empty() {
            return "the model has no labelled Gaussian; train it with masks".to_owned();
        }
        let more = objects.count() - texts.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let zero = if self.gaussians.contains_key(&UNLABELLED) { ", and 0 for the unlabelled" } else { "" };
        format!("the model has {}{more}{zero}", texts.join(", "))
    }
}
