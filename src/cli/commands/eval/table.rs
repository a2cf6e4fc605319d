//! Scores as tables.

use crate::cli::support::tables::{Column, DECIBEL_DIGITS, Part, Parts, SCORE_DIGITS, Table, column, number};
use crate::eval::PlaceScore;
use crate::eval::removal::ObjectRemoval;
use crate::eval::scores::{MeanScores, ObjectScores, Scores, ViewScores};
use crate::files::label_table::LabelTable;

const VIEW_COLUMNS: [Column<MeanScores>; 4] = [
    column("PSNR", "PSNR, dB", DECIBEL_DIGITS, |row| row.psnr),
    column("corrected", "PSNR after colour correction, dB", DECIBEL_DIGITS, |row| row.psnr_corrected),
    column("SSIM", "SSIM", SCORE_DIGITS, |row| row.ssim),
    column("LPIPS", "LPIPS", SCORE_DIGITS, |row| row.lpips),
];
const OBJECT_COLUMNS: [Column<ObjectScores>; 8] = [
    column("IoU", "IoU of the label map", SCORE_DIGITS, |row| row.iou_map),
    column("bIoU", "Boundary IoU", SCORE_DIGITS, |row| row.boundary_iou),
    column("whole", "IoU of the whole object", SCORE_DIGITS, |row| row.iou_object),
    column("paper", "IoU as in the LabelGS paper", SCORE_DIGITS, |row| row.paper_iou),
    column("PSNR", "PSNR alone, dB", DECIBEL_DIGITS, |row| row.object_psnr),
    column("SSIM", "SSIM alone", SCORE_DIGITS, |row| row.object_ssim),
    column("hidden", "IoU of hidden parts", SCORE_DIGITS, |row| row.iou_hidden),
    column("dB hidden", "PSNR of hidden parts, dB", DECIBEL_DIGITS, |row| row.psnr_hidden),
];
const PLACE_COLUMNS: [Column<PlaceScore>; 2] = [
    column("PSNR", "PSNR, dB", DECIBEL_DIGITS, |row| Some(row.psnr)),
    column("pixels", "Pixels", 0, |row| Some(row.pixels as f64)),
];
const REMOVAL_COLUMNS: [Column<ObjectRemoval>; 4] = [
    column("removed", "Removed, dB", DECIBEL_DIGITS, |row| row.votes.psnr),
    column("filled", "Filled, dB", DECIBEL_DIGITS, |row| row.filled.psnr),
    column("mean colour", "Mean colour, dB", DECIBEL_DIGITS, |row| row.mean_colour.psnr),
    column("paper's", "Paper's rule, dB", DECIBEL_DIGITS, |row| row.main.psnr),
];
const SHADOW_COLUMNS: [Column<ObjectRemoval>; 4] = [
    column("removed", "Removed, dB", DECIBEL_DIGITS, |row| row.votes.psnr_shadowed),
    column("filled", "Filled, dB", DECIBEL_DIGITS, |row| row.filled.psnr_shadowed),
    column("mean colour", "Mean colour, dB", DECIBEL_DIGITS, |row| row.mean_colour.psnr_shadowed),
    column("paper's", "Paper's rule, dB", DECIBEL_DIGITS, |row| row.main.psnr_shadowed),
];
const REMAINDER_COLUMNS: [Column<ObjectRemoval>; 7] = [
    column("area", "Area left", SCORE_DIGITS, |row| row.votes.leftover),
    column("paper's", "Paper's rule", SCORE_DIGITS, |row| row.main.leftover),
    column("weight", "Weight left", SCORE_DIGITS, |row| row.votes.leftover_weight),
    column("paper's", "Paper's rule", SCORE_DIGITS, |row| row.main.leftover_weight),
    column("hole", "Hole", SCORE_DIGITS, |row| row.hole),
    column("filled", "Hole after --fill", SCORE_DIGITS, |row| row.hole_filled),
    column("added", "Gaussians added", 0, |row| Some(row.added as f64)),
];
const HOLE_COLUMNS: [Column<ObjectRemoval>; 3] = [
    column("filled", "Filled, dB", DECIBEL_DIGITS, |row| row.holes.filled),
    column("with shadow", "Filled, with its shadow, dB", DECIBEL_DIGITS, |row| row.holes.filled_shadowed),
    column("ring mean", "Mean of the ring around, dB", DECIBEL_DIGITS, |row| row.holes.mean_colour),
];

/// Returns the tables of views, then of objects, which have names from a table.
pub(super) fn tables(scores: &Scores, names: Option<&LabelTable>) -> Parts {
    let mut parts = Vec::new();
    if scores.refined_poses {
        parts.push(Part::Note("Poses were aligned with the model.".to_owned()));
    }
    let mean = &scores.mean;
    let views: Vec<(String, MeanScores)> =
        scores.views.iter().map(|(name, view)| (name.clone(), of_view(view))).collect();
    let rows = views.iter().map(|(name, view)| (name.clone(), view));
    parts.push(Part::Table(Table::new("view", &VIEW_COLUMNS, rows.chain([("mean".to_owned(), mean)]))));
    parts.extend(regions(scores));
    if !scores.places.is_empty() {
        parts.push(Part::Title("places".to_owned()));
        let rows = scores.places.iter().map(|(name, score)| (name.clone(), score));
        parts.push(Part::Table(Table::new("place", &PLACE_COLUMNS, rows)));
    }
    if scores.objects.is_empty() {
        return Parts(parts);
    }
    let title = |id: u32| names.and_then(|names| names.name(id)).map_or_else(|| format!("label {id}"), str::to_owned);
    let rows = scores.objects.iter().map(|(&id, scores)| (title(id), scores));
    parts.push(Part::Title("objects".to_owned()));
    parts.push(Part::Table(Table::new("object", &OBJECT_COLUMNS, rows.chain([("mean".to_owned(), &mean.objects)]))));
    if mean.specks.is_some() {
        let count = number(mean.specks, 1);
        parts.push(Part::Note(format!("Extra fragments in the label map, not in the masks: {count} per view.")));
    }
    parts.extend(removals(scores, &title));
    Parts(parts)
}

fn of_view(view: &ViewScores) -> MeanScores {
    let ViewScores { psnr, psnr_corrected, ssim, lpips, .. } = *view;
    MeanScores {
        psnr: Some(psnr),
        psnr_corrected: Some(psnr_corrected),
        ssim: Some(ssim),
        lpips,
        ..MeanScores::default()
    }
}

/// Returns the tables of removals.
fn removals(scores: &Scores, title: &impl Fn(u32) -> String) -> Vec<Part> {
    let Some(removal) = &scores.removal else { return Vec::new() };
    let table = |columns: &[Column<ObjectRemoval>]| {
        let rows = removal.objects.iter().map(|(&id, row)| (title(id), row));
        Part::Table(Table::new("object", columns, rows.chain([("mean".to_owned(), &removal.mean)])))
    };
    let heading = |text: &str| Part::Title(text.to_owned());
    vec![
        heading("PSNR where an object was removed, against photos without it"),
        table(&REMOVAL_COLUMNS),
        heading("the same, against photos that keep its shadow"),
        table(&SHADOW_COLUMNS),
        heading("remains after removal, as shares of the object, and hole, as a share of its area"),
        table(&REMAINDER_COLUMNS),
        heading("PSNR in the holes"),
        table(&HOLE_COLUMNS),
    ]
}

/// Returns the PSNR by region.
fn regions(scores: &Scores) -> Option<Part> {
    let mean = scores.mean.regions.as_ref()?;
    let psnr = |value| number(value, DECIBEL_DIGITS);
    let mut text = format!(
        "PSNR by region: {} ({} corrected) where three training views see ({:.0} % of the pixels), {} elsewhere",
        psnr(mean.psnr_seen),
        psnr(mean.psnr_seen_corrected),
        100.0 * mean.seen_share.unwrap_or(0.0),
        psnr(mean.psnr_unseen)
    );
    if mean.psnr_objects.is_some() {
        let [objects, contours, rest] = [mean.psnr_objects, mean.psnr_contours, mean.psnr_rest].map(psnr);
        text += &format!("; objects {objects}, contours {contours}, rest {rest}");
    }
    Some(Part::Note(text + "."))
}
