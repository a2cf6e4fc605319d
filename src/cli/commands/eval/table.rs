//! Scores as text.

use crate::cli::support::scoring::number;
use crate::eval::scores::Scores;

/// Returns the table of views, then of objects.
pub(super) fn table(scores: &Scores) -> String {
    let mut text = if scores.refined_poses { "poses refined by the model\n".to_owned() } else { String::new() };
    let mean = &scores.mean;
    // A column for LPIPS only where it was asked for.
    let lpips = |cell: String| mean.lpips.map_or(String::new(), |_| format!(" {cell:>8}"));
    text += &format!("{:>10} {:>8} {:>9} {:>8}{}\n", "view", "PSNR", "corrected", "SSIM", lpips("LPIPS".to_owned()));
    for (name, view) in &scores.views {
        let (psnr, corrected, ssim) = (view.psnr, view.psnr_corrected, view.ssim);
        text += &format!("{name:>10} {psnr:>8.2} {corrected:>9.2} {ssim:>8.4}{}\n", lpips(number(view.lpips, 4)));
    }
    let cells = (number(mean.psnr, 2), number(mean.psnr_corrected, 2), number(mean.ssim, 4));
    let last = lpips(number(mean.lpips, 4));
    text += &format!("{:>10} {:>8} {:>9} {:>8}{last}\n", "mean", cells.0, cells.1, cells.2);
    text += &regions(scores);
    text += &places(scores);
    if scores.objects.is_empty() {
        return text;
    }
    text += &format!(
        "\n{:>10} {:>8} {:>12} {:>10} {:>9} {:>11} {:>11} {:>10} {:>11}\n",
        "object",
        "iou_map",
        "boundary_iou",
        "iou_object",
        "paper_iou",
        "object_psnr",
        "object_ssim",
        "iou_hidden",
        "psnr_hidden"
    );
    let rows = scores.objects.iter().map(|(id, scores)| (id.to_string(), scores));
    for (name, row) in rows.chain([("mean".to_owned(), &scores.mean.objects)]) {
        text += &format!(
            "{name:>10} {:>8} {:>12} {:>10} {:>9} {:>11} {:>11} {:>10} {:>11}\n",
            number(row.iou_map, 4),
            number(row.boundary_iou, 4),
            number(row.iou_object, 4),
            number(row.paper_iou, 4),
            number(row.object_psnr, 2),
            number(row.object_ssim, 4),
            number(row.iou_hidden, 4),
            number(row.psnr_hidden, 2)
        );
    }
    if mean.specks.is_some() {
        text += &format!("specks of the label map that masks do not have: {} in a view\n", number(mean.specks, 1));
    }
    text + &removals(scores)
}

/// Returns the table of places.
fn places(scores: &Scores) -> String {
    if scores.places.is_empty() {
        return String::new();
    }
    let mut text = format!("\n{:>14} {:>8} {:>10}\n", "place", "PSNR", "pixels");
    for (name, score) in &scores.places {
        text += &format!("{name:>14} {:>8} {:>10}\n", number(Some(score.psnr), 2), score.pixels);
    }
    text
}

/// Returns the table of removals.
fn removals(scores: &Scores) -> String {
    let Some(removal) = &scores.removal else { return String::new() };
    let head = ["removed", "filled", "mean colour", "paper's"];
    let mut text =
        "\nPSNR at the place of a removed object, against photos without it, and with its shadow\n".to_owned();
    text += &format!("{:>10}", "object");
    head.iter().chain(&head).for_each(|name| text += &format!(" {name:>11}"));
    text += "\n";
    let rows = || removal.objects.iter().map(|(id, row)| (id.to_string(), row)).chain([("mean".into(), &removal.mean)]);
    for (name, row) in rows() {
        let ways = [row.votes, row.filled, row.mean_colour, row.main];
        text += &format!("{name:>10}");
        ways.iter().for_each(|way| text += &format!(" {:>11}", number(way.psnr, 2)));
        ways.iter().for_each(|way| text += &format!(" {:>11}", number(way.psnr_shadowed, 2)));
        text += "\n";
    }
    text += &format!(
        "\n{:>10} {:>10} {:>10} {:>13} {:>13} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9}\n",
        "object",
        "leftover",
        "paper's",
        "weight left",
        "paper's",
        "hole",
        "filled",
        "added",
        "in holes",
        "shadowed",
        "ring mean"
    );
    for (name, row) in rows() {
        text += &format!(
            "{name:>10} {:>10} {:>10} {:>13} {:>13} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9}\n",
            number(row.votes.leftover, 4),
            number(row.main.leftover, 4),
            number(row.votes.leftover_weight, 4),
            number(row.main.leftover_weight, 4),
            number(row.hole, 4),
            number(row.hole_filled, 4),
            row.added,
            number(row.holes.filled, 2),
            number(row.holes.filled_shadowed, 2),
            number(row.holes.mean_colour, 2)
        );
    }
    text
}

/// Returns the PSNR by region.
fn regions(scores: &Scores) -> String {
    let mut text = String::new();
    if let Some(mean) = &scores.mean.regions {
        text += &format!(
            "\nPSNR by region: {} ({} corrected) where three training views see ({:.0} % of the pixels), {} elsewhere",
            number(mean.psnr_seen, 2),
            number(mean.psnr_seen_corrected, 2),
            100.0 * mean.seen_share.unwrap_or(0.0),
            number(mean.psnr_unseen, 2)
        );
        if mean.psnr_objects.is_some() {
            text += &format!(
                "; objects {}, contours {}, rest {}",
                number(mean.psnr_objects, 2),
                number(mean.psnr_contours, 2),
                number(mean.psnr_rest, 2)
            );
        }
        text += "\n";
    }
    text
}
