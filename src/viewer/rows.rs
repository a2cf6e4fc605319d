//! Rows of the label panel, and a history of steps of bounded length.

use crate::edit::catalogue::Catalogue;
use crate::edit::oriented_box::Boxes;
use crate::edit::select::{LabelSummary, mean_confidence, summarise};
use crate::files::label_table::LabelTable;
use crate::scene::Gaussians;
use crate::scene::labels::label_colour;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Maximum number of labels in the list of a page.
const ROWS_MAX: usize = 4096;

/// Returns the rows for the labels of a finished model.
pub(super) fn of_model(model: &Gaussians, table: Option<&LabelTable>) -> Value {
    let confidence = mean_confidence(model);
    let mut boxes = Boxes::new(&Catalogue::new(model, None).gaussians);
    for row in 0..model.len() {
        let weight = model.opacity(row) * model.label_confidence.as_ref().map_or(1.0, |shares| f64::from(shares[row]));
        boxes.add(model.label(row), model.world(row), weight, model.quats[row].map(f64::from), model.scales[row]);
    }
    let boxes = boxes.finish();
    let row = |summary: &LabelSummary| {
        json!({
            "id": summary.label,
            "name": table.and_then(|table| table.name(summary.label)),
            "colour": label_colour(summary.label),
            "count": summary.count,
            "confidence": confidence.get(&summary.label),
            "min": summary.min,
            "max": summary.max,
            "box": boxes.get(&summary.label),
        })
    };
    let all = if model.labels.is_some() { summarise(model) } else { Vec::new() };
    described(all.iter().take(ROWS_MAX).map(row).collect(), all.len())
}

/// Returns the rows for the labels in a training.
pub(super) fn of_training(labels: &[u32], table: Option<&LabelTable>) -> Value {
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    labels.iter().for_each(|&label| *counts.entry(label).or_default() += 1);
    // Objects of the masks that no Gaussian has yet are named too.
    table.iter().flat_map(|table| &table.labels).for_each(|entry| {
        counts.entry(entry.id).or_default();
    });
    let row = |(&id, &count): (&u32, &u64)| json!({ "id": id, "name": table.and_then(|table| table.name(id)), "colour": label_colour(id), "count": count });
    described(counts.iter().take(ROWS_MAX).map(row).collect(), counts.len())
}

fn described(rows: Vec<Value>, all: usize) -> Value {
    json!({ "kind": "labels", "rows": rows, "all": all })
}

/// Maximum number of points of a curve.
const POINTS_MAX: usize = 512;

/// Numbers by step. When it is full, every second point goes, and from then on half as many come.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    points: Vec<(u32, [f64; 3])>,
    /// Steps between two points.
    every: u32,
}

impl Default for Curve {
    fn default() -> Self {
        Self { points: Vec::new(), every: 1 }
    }
}

impl Curve {
    /// Adds loss, label loss and Gaussians of a step.
    pub(super) fn add(&mut self, step: u32, values: [f64; 3]) {
        if self.points.last().is_some_and(|last| step < last.0 + self.every) {
            return;
        }
        self.points.push((step, values));
        if self.points.len() >= POINTS_MAX {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every *= 2;
        }
    }

    pub(super) fn describe(&self) -> Value {
        let of = |index: usize| self.points.iter().map(|point| point.1[index]).collect::<Vec<_>>();
        let steps: Vec<u32> = self.points.iter().map(|point| point.0).collect();
        json!({ "kind": "curve", "steps": steps, "loss": of(0), "label": of(1), "gaussians": of(2) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_stays_short_and_keeps_its_ends() {
        let mut curve = Curve::default();
        (1..=30_000).for_each(|step| curve.add(step, [f64::from(step); 3]));
        assert!((POINTS_MAX / 2 - 1..POINTS_MAX).contains(&curve.points.len()), "{}", curve.points.len());
        assert_eq!(curve.points[0].0, 1);
        assert!(curve.points.last().expect("points").0 > 29_800);
        let gaps = curve.points.windows(2).map(|pair| pair[1].0 - pair[0].0);
        assert!(gaps.max() <= Some(curve.every * 2));
    }
}
