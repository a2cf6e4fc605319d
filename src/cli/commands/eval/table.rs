//! Scores as text.

use crate::cli::support::table::{self, Column, number};
use crate::eval::PlaceScore;
use crate::eval::removal::ObjectRemoval;
use crate::eval::scores::{MeanScores, ObjectScores, Scores, ViewScores};

const VIEWS: [Column<MeanScores>; 4] = [
    ("PSNR", 8, 2, |row| row.psnr),
    ("corrected", 9, 2, |row| row.psnr_corrected),
    ("SSIM", 8, 4, |row| row.ssim),
    ("LPIPS", 8, 4, |row| row.lpips),
];
const OBJECTS: [Column<ObjectScores>; 8] = [
    ("iou_map", 8, 4, |row| row.iou_map),
    ("boundary_iou", 12, 4, |row| row.boundary_iou),
    ("iou_object", 10, 4, |row| row.iou_object),
    ("paper_iou", 9, 4, |row| row.paper_iou),
    ("object_psnr", 11, 2, |row| row.object_psnr),
    ("object_ssim", 11, 4, |row| row.object_ssim),
    ("iou_hidden", 10, 4, |row| row.iou_hidden),
    ("psnr_hidden", 11, 2, |row| row.psnr_hidden),
];
const PLACES: [Column<PlaceScore>; 2] =
    [("PSNR", 8, 2, |row| Some(row.psnr)), ("pixels", 10, 0, |row| Some(row.pixels as f64))];
const REMOVED: [Column<ObjectRemoval>; 8] = [
    ("removed", 11, 2, |row| row.votes.psnr),
    ("filled", 11, 2, |row| row.filled.psnr),
    ("mean colour", 11, 2, |row| row.mean_colour.psnr),
    ("paper's", 11, 2, |row| row.main.psnr),
    ("removed", 11, 2, |row| row.votes.psnr_shadowed),
    ("filled", 11, 2, |row| row.filled.psnr_shadowed),
    ("mean colour", 11, 2, |row| row.mean_colour.psnr_shadowed),
    ("paper's", 11, 2, |row| row.main.psnr_shadowed),
];
const LEFT: [Column<ObjectRemoval>; 10] = [
    ("leftover", 10, 4, |row| row.votes.leftover),
    ("paper's", 10, 4, |row| row.main.leftover),
    ("weight left", 13, 4, |row| row.votes.leftover_weight),
    ("paper's", 13, 4, |row| row.main.leftover_weight),
    ("hole", 8, 4, |row| row.hole),
    ("filled", 8, 4, |row| row.hole_filled),
    ("added", 8, 0, |row| Some(row.added as f64)),
    ("in holes", 9, 2, |row| row.holes.filled),
    ("shadowed", 9, 2, |row| row.holes.filled_shadowed),
    ("ring mean", 9, 2, |row| row.holes.mean_colour),
];

/// Returns the table of views, then of objects.
pub(super) fn table(scores: &Scores) -> String {
    let mut text = if scores.refined_poses { "poses refined by the model\n".to_owned() } else { String::new() };
    let mean = &scores.mean;
    // A column for LPIPS only where it was asked for.
    let columns = if mean.lpips.is_some() { &VIEWS[..] } else { &VIEWS[..3] };
    let views: Vec<(String, MeanScores)> =
        scores.views.iter().map(|(name, view)| (name.clone(), of_view(view))).collect();
    let rows = views.iter().map(|(name, view)| (name.clone(), view));
    text += &table::table(("view", 10), columns, rows.chain([("mean".to_owned(), mean)]));
    text += &regions(scores);
    if !scores.places.is_empty() {
        let rows = scores.places.iter().map(|(name, score)| (name.clone(), score));
        text += &format!("\n{}", table::table(("place", 14), &PLACES, rows));
    }
    if scores.objects.is_empty() {
        return text;
    }
    let rows = scores.objects.iter().map(|(id, scores)| (id.to_string(), scores));
    let rows = rows.chain([("mean".to_owned(), &mean.objects)]);
    text += &format!("\n{}", table::table(("object", 10), &OBJECTS, rows));
    if mean.specks.is_some() {
        text += &format!("specks of the label map that masks do not have: {} in a view\n", number(mean.specks, 1));
    }
    text + &removals(scores)
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
fn removals(scores: &Scores) -> String {
    let Some(removal) = &scores.removal else { return String::new() };
    let rows = || removal.objects.iter().map(|(id, row)| (id.to_string(), row)).chain([("mean".into(), &removal.mean)]);
    format!(
        "\nPSNR at the place of a removed object, against photos without it, and with its shadow\n{}\n{}",
        table::table(("object", 10), &REMOVED, rows()),
        table::table(("object", 10), &LEFT, rows())
    )
}

/// Returns the PSNR by region.
fn regions(scores: &Scores) -> String {
    let Some(mean) = &scores.mean.regions else { return String::new() };
    let psnr = |value| number(value, 2);
    let mut text = format!(
        "\nPSNR by region: {} ({} corrected) where three training views see ({:.0} % of the pixels), {} elsewhere",
        psnr(mean.psnr_seen),
        psnr(mean.psnr_seen_corrected),
        100.0 * mean.seen_share.unwrap_or(0.0),
        psnr(mean.psnr_unseen)
    );
    if mean.psnr_objects.is_some() {
        let [objects, contours, rest] = [mean.psnr_objects, mean.psnr_contours, mean.psnr_rest].map(psnr);
        text += &format!("; objects {objects}, contours {contours}, rest {rest}");
    }
    text + "\n"
}
