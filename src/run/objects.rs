//! The objects of a model, as a run reports them.

use crate::edit::catalogue::Catalogue;
use crate::edit::select::mean_confidence;
use crate::eval::scores::{ObjectScores, Scores};
use crate::files::label_table::LabelTable;
use crate::scene::{Gaussians, UNLABELLED};
use serde::{Deserialize, Serialize};

/// An object of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectSummary {
    /// Id.
    pub id: u32,
    /// Name, if the masks came with names.
    pub name: Option<String>,
    /// Gaussians with this label.
    pub gaussians: u64,
    /// Mean confidence of their labels.
    pub confidence: Option<f64>,
    /// Mean IoU of the label map in held-out views.
    pub iou: Option<f64>,
    /// Mean PSNR of the object rendered alone, dB.
    pub psnr: Option<f64>,
    /// View with the lowest IoU.
    pub worst_view: Option<String>,
    /// IoU in that view.
    pub worst_iou: Option<f64>,
}

/// Summarises the objects of a model, and of the masks that it was scored with.
pub(super) fn summaries(model: &Gaussians, names: Option<&LabelTable>, scores: Option<&Scores>) -> Vec<ObjectSummary> {
    if model.labels.is_none() {
        return Vec::new();
    }
    let (catalogue, confidence) = (Catalogue::new(model, names.cloned()), mean_confidence(model));
    let scored = scores.map(|scores| scores.objects.clone()).unwrap_or_default();
    let mut ids: Vec<u32> = catalogue.gaussians.keys().chain(scored.keys()).copied().collect();
    ids.sort_unstable();
    ids.dedup();
    let of_label = |id: u32| {
        let gaussians = catalogue.gaussians.get(&id).copied().unwrap_or(0);
        let of_object = scored.get(&id).copied().unwrap_or_default();
        let worst = scores.and_then(|scores| worst_view(scores, id));
        ObjectSummary {
            id,
            name: catalogue.name(id).map(str::to_owned),
            gaussians,
            confidence: confidence.get(&id).copied(),
            iou: iou(&of_object),
            psnr: of_object.object_psnr,
            worst_view: worst.as_ref().map(|worst| worst.0.clone()),
            worst_iou: worst.map(|worst| worst.1),
        }
    };
    ids.into_iter().filter(|&id| id != UNLABELLED).map(of_label).collect()
}

fn iou(scores: &ObjectScores) -> Option<f64> {
    scores.iou_map.or(scores.iou_object)
}

fn worst_view(scores: &Scores, id: u32) -> Option<(String, f64)> {
    let of_view = |(name, view): (&String, &crate::eval::scores::ViewScores)| {
        Some((name.clone(), view.objects.get(&id).and_then(iou)?))
    };
    scores.views.iter().filter_map(of_view).min_by(|a, b| a.1.total_cmp(&b.1))
}
