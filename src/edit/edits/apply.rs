//! Applies edits to a model.

use super::Edit;
use crate::add::add;
use crate::catalogue::Catalogue;
use crate::change::{SmallParts, recolour, split_components};
use crate::components::Grouping;
use crate::fill::{Light, Sight, fill};
use crate::merge::{MergedLabels, merge};
use crate::rename::{keep, split};
use crate::select::{nothing_left, remove};
use glam::DVec3;
use labelgs_files::label_table::LabelTable;
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Gaussians, Result, UNLABELLED};
use std::collections::BTreeSet;

/// A model with the names of its labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The model.
    pub model: Gaussians,
    /// The names, if the model has any.
    pub table: Option<LabelTable>,
}

/// Renders what the views of a scene show of a model, for [`fill`].
pub type Sights<'a> = dyn FnMut(&Gaussians) -> Result<Vec<Sight>> + 'a;

impl Document {
    /// Returns the edited document. Calls `sights` only to fill the hole of a removed object.
    ///
    /// # Errors
    ///
    /// A value out of bounds; a missing label or row; an edit that would leave no Gaussian.
    pub fn apply(&self, edit: &Edit, sights: &mut Sights) -> Result<Self> {
        if let Some(problem) = edit.problem() {
            return Err(Error::usage("edit", problem));
        }
        let labels: BTreeSet<u32> = edit.labels().iter().copied().collect();
        let rows = edit.rows().map(|rows| rows.mask(self.model.len())).transpose()?;
        match &rows {
            Some(rows) if !rows.contains(&true) => return Err(Error::usage("choice", "no Gaussian is chosen")),
            Some(_) => {}
            None => self.catalogue().check("labels", &labels)?,
        }
        let rows = rows.unwrap_or_default();
        match edit {
            Edit::Rename { name, .. } => self.merged(&labels, Some(name)),
            Edit::Merge { .. } => self.merged(&labels, None),
            Edit::Split { label } => self.split(*label),
            Edit::Recolour { colour, mix, .. } => {
                Ok(Self { model: recolour(&self.model, &labels, *colour, *mix), table: self.table.clone() })
            }
            Edit::Remove { labels: listed, fill } => {
                let model = if *fill { self.filled(listed, sights)? } else { remove(&self.model, listed)? };
                Ok(Self { model, table: self.table.as_ref().map(|table| keep(table, |id| !labels.contains(&id))) })
            }
            Edit::Assign { label: None, name, .. } => {
                let MergedLabels { model, table, .. } = add(&self.model, self.table.clone(), &rows, name.as_deref())?;
                Ok(Self { model, table })
            }
            Edit::Assign { label: Some(label), .. } => self.assigned(&rows, *label),
            Edit::Delete { .. } => self.kept(|row| !rows[row]),
            Edit::Keep { .. } => self.kept(|row| rows[row]),
            Edit::Duplicate { shift, name, .. } => self.doubled(&rows, DVec3::from(*shift), name.as_deref()),
        }
    }

    /// Describes an edit of this document in a sentence.
    pub fn told(&self, edit: &Edit) -> String {
        let known = self.catalogue();
        let title = |id: u32| match (id, known.name(id)) {
            (UNLABELLED, _) => "background".to_owned(),
            (_, Some(name)) => name.to_owned(),
            _ => format!("label {id}"),
        };
        let titles = |ids: &[u32]| match ids {
            [] => "nothing".to_owned(),
            [one] => title(*one),
            [first, rest @ ..] if rest.len() < 3 => {
                let rest: Vec<String> = rest.iter().map(|&id| title(id)).collect();
                format!("{}, {}", title(*first), rest.join(", "))
            }
            many => counted(many.len(), "label"),
        };
        let size = edit.rows().map_or(String::new(), |rows| counted(rows.count(), "Gaussian"));
        let called = |name: &Option<String>| name.as_ref().map_or(String::new(), |name| format!(": {name}"));
        match edit {
            Edit::Rename { label, name } => format!("Renamed {} to {name}", title(*label)),
            Edit::Merge { labels } => format!("Merged {}", titles(labels)),
            Edit::Split { label } => format!("Split {}", title(*label)),
            Edit::Recolour { labels, .. } => format!("Recoloured {}", titles(labels)),
            Edit::Remove { labels, fill: false } => format!("Removed {}", titles(labels)),
            Edit::Remove { labels, fill: true } => format!("Removed {}, filled", titles(labels)),
            Edit::Assign { label: None, name, .. } => format!("New label of {size}{}", called(name)),
            Edit::Assign { label: Some(UNLABELLED), .. } => format!("Removed the label of {size}"),
            Edit::Assign { label: Some(label), .. } => format!("Gave {size} to {}", title(*label)),
            Edit::Delete { .. } => format!("Deleted {size}"),
            Edit::Keep { .. } => format!("Kept only {size}"),
            Edit::Duplicate { name, .. } => format!("Duplicated {size}{}", called(name)),
        }
    }

    fn catalogue(&self) -> Catalogue {
        Catalogue::new(&self.model, self.table.clone())
    }

    fn merged(&self, labels: &BTreeSet<u32>, name: Option<&str>) -> Result<Self> {
        let MergedLabels { model, table, .. } = merge(&self.model, &self.catalogue(), labels, None, name)?;
        Ok(Self { model, table })
    }

    fn split(&self, label: u32) -> Result<Self> {
        let taken = self.table.iter().flat_map(|table| &table.labels).map(|entry| entry.id).collect();
        let labels = BTreeSet::from([label]);
        let found = split_components(&self.model, &labels, &taken, Grouping::default(), SmallParts::Keep)?;
        if found.ids.values().all(|ids| ids.len() < 2) {
            return Err(Error::usage("labels", "the label has only one part; choose some of its Gaussians instead"));
        }
        Ok(Self { model: found.model, table: self.table.as_ref().map(|table| split(table, &found.ids)) })
    }

    fn filled(&self, labels: &[u32], sights: &mut Sights) -> Result<Gaussians> {
        // Refuse an empty choice, or one of everything, before rendering.
        remove(&self.model, labels)?;
        let sights = sights(&self.model)?;
        let light = Light::of(&self.model, &sights)?;
        Ok(fill(&self.model, labels, &sights, light.as_ref())?.model)
    }

    fn assigned(&self, rows: &[bool], label: u32) -> Result<Self> {
        if label != UNLABELLED {
            let is_named = self.table.as_ref().is_some_and(|table| table.labels.iter().any(|entry| entry.id == label));
            if !is_named {
                self.catalogue().check("label", &BTreeSet::from([label]))?;
            }
        }
        let mut model = self.model.clone();
        let labels = model.labels.get_or_insert_with(|| vec![UNLABELLED; rows.len()]);
        labels.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(own, _)| *own = label);
        if let Some(shares) = &mut model.label_confidence {
            shares.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(share, _)| *share = 1.0);
        }
        Ok(Self { model, table: self.table.clone() })
    }

    fn kept(&self, is_kept: impl FnMut(usize) -> bool) -> Result<Self> {
        let model = self.model.filtered(is_kept);
        if model.is_empty() {
            return Err(nothing_left());
        }
        // Remove labels that have lost their last Gaussian.
        let before = self.catalogue().gaussians;
        let after = Catalogue::new(&model, None).gaussians;
        let is_left = |id| after.contains_key(&id) || !before.contains_key(&id);
        Ok(Self { model, table: self.table.as_ref().map(|table| keep(table, is_left)) })
    }

    fn doubled(&self, rows: &[bool], shift: DVec3, name: Option<&str>) -> Result<Self> {
        let mut model = self.model.clone();
        model.labels.get_or_insert_with(|| vec![UNLABELLED; rows.len()]);
        let mut copies = model.filtered(|row| rows[row]);
        copies.means.iter_mut().for_each(|mean| *mean = (DVec3::from(mean.map(f64::from)) + shift).as_vec3().into());
        let is_new: Vec<bool> = (0..model.len() + copies.len()).map(|row| row >= rows.len()).collect();
        model.append(copies);
        let MergedLabels { model, table, .. } = add(&model, self.table.clone(), &is_new, name)?;
        Ok(Self { model, table })
    }
}
