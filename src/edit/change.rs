//! Changes colours or labels of a model.

use super::components::{Grouping, components};
use labelgs_scene::harmonics::sh0_of;
use labelgs_scene::{Error, Gaussians, LABEL_MAX, MODEL_LABEL_MAX, Result, Setting, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};

/// What happens to parts that are too small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum SmallParts {
    /// Fragments keep their label.
    #[default]
    Keep,
    /// Fragments lose their label.
    Unlabel,
    /// Remove fragments from the model.
    Drop,
}

/// Returns the label of each row; all 0 in a model without labels.
fn labels_of(model: &Gaussians) -> Vec<u32> {
    model.labels.clone().unwrap_or_else(|| vec![UNLABELLED; model.len()])
}

/// Mixes a colour (r, g, b, 0 to 1) into the Gaussians of some labels. A `mix` of 1 replaces their colour in every
/// direction; 0 keeps it.
pub fn recolour(model: &Gaussians, labels: &BTreeSet<u32>, colour: [f32; 3], mix: f32) -> Gaussians {
    let mut out = model.clone();
    let target = colour.map(|value| sh0_of(f64::from(value)));
    for (row, label) in labels_of(model).into_iter().enumerate() {
        if labels.contains(&label) {
            mix_in(&mut out, row, target, mix);
        }
    }
    out
}

/// Mixes a degree-0 coefficient (r, g, b) into a Gaussian.
pub fn mix_in(model: &mut Gaussians, row: usize, target: [f32; 3], mix: f32) {
    let old = model.sh0[row];
    model.sh0[row] = [0, 1, 2].map(|c| old[c] * (1.0 - mix) + target[c] * mix);
    model.rest_mut(row).iter_mut().flatten().for_each(|value| *value *= 1.0 - mix);
}

/// Replaces labels by new ids, all at once. Labels missing from the map stay.
pub fn relabel(model: &Gaussians, map: &BTreeMap<u32, u32>) -> Gaussians {
    let labels = labels_of(model).iter().map(|label| *map.get(label).unwrap_or(label)).collect();
    Gaussians { labels: Some(labels), ..model.clone() }
}

/// The result of [`split_components`].
#[derive(Clone, Debug, PartialEq)]
pub struct SplitLabels {
    /// The model with its new labels.
    pub model: Gaussians,
    /// For each split label, the ids of its parts by decreasing size. The largest part keeps the old id.
    pub ids: BTreeMap<u32, Vec<u32>>,
    /// Number of Gaussians in parts that were too small.
    pub specks: u64,
}

/// Splits each of `labels` into connected parts. The largest part keeps the id; the others get the next ids that are
/// neither in the model nor in `taken`.
pub fn split_components(
    model: &Gaussians,
    labels: &BTreeSet<u32>,
    taken: &BTreeSet<u32>,
    how: Grouping,
    specks: SmallParts,
) -> Result<SplitLabels> {
    let mut new = labels_of(model);
    let old = new.clone();
    let used: BTreeSet<u32> = taken.iter().copied().chain(old.iter().copied()).collect();
    let last = used.last().copied().unwrap_or(UNLABELLED);
    // Use ids after the last one, then gaps. Stay within the ids that masks can hold if the model does.
    let most = if last > LABEL_MAX { MODEL_LABEL_MAX } else { LABEL_MAX };
    let mut free = (last + 1..=most).chain((1..last).filter(|id| !used.contains(id)));
    let (mut ids, mut small) = (BTreeMap::new(), BTreeSet::new());
    for &label in labels {
        let found = components(model, &rows_of(&old, label), how)?;
        let mut own = vec![label];
        for part in found.parts.iter().skip(1) {
            let none = || Error::usage(Setting("labels"), format!("{} parts, and no id is free", found.parts.len()));
            let id = free.next().ok_or_else(none)?;
            part.iter().for_each(|&row| new[row] = id);
            own.push(id);
        }
        ids.insert(label, own);
        small.extend(found.specks);
    }
    if specks == SmallParts::Unlabel {
        small.iter().for_each(|&row| new[row] = UNLABELLED);
    }
    let labelled = Gaussians { labels: Some(new), ..model.clone() };
    let model = if specks == SmallParts::Drop { labelled.filtered(|row| !small.contains(&row)) } else { labelled };
    Ok(SplitLabels { model, ids, specks: small.len() as u64 })
}

/// Returns the model without the specks of each label.
pub fn without_specks(model: &Gaussians, how: Grouping) -> Result<Gaussians> {
    let labels = labels_of(model);
    let mut specks = BTreeSet::new();
    for &label in &labels.iter().copied().collect::<BTreeSet<u32>>() {
        specks.extend(components(model, &rows_of(&labels, label), how)?.specks);
    }
    Ok(model.filtered(|row| !specks.contains(&row)))
}

fn rows_of(labels: &[u32], label: u32) -> Vec<usize> {
    (0..labels.len()).filter(|&row| labels[row] == label).collect()
}
