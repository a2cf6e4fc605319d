//! Scores of a benchmark as tables.

use crate::cli::support::tables::{Column, DECIBEL_DIGITS, Part, Parts, SCORE_DIGITS, Table, column, number};
use crate::eval::protocol::report::{MissingPrediction, Report};
use crate::eval::protocol::score::PairScores;

const SCORE_COLUMNS: [Column<PairScores>; 7] = [
    column("IoU", "IoU", SCORE_DIGITS, |row| row.iou),
    column("by colour", "IoU by colour", SCORE_DIGITS, |row| row.iou_colour),
    column("bIoU", "Boundary IoU", SCORE_DIGITS, |row| row.boundary_iou),
    column("accuracy", "Accuracy", SCORE_DIGITS, |row| row.accuracy),
    column("PSNR", "PSNR, dB", DECIBEL_DIGITS, |row| row.psnr),
    column("SSIM", "SSIM", SCORE_DIGITS, |row| row.ssim),
    column("LPIPS", "LPIPS", SCORE_DIGITS, |row| row.lpips),
];

/// Returns the table of objects with averages, then everything that is missing.
pub(super) fn tables(report: &Report) -> Parts {
    let compat = if report.compat { ", as the published scorer" } else { "" };
    let labels = report.objects.values().map(|object| {
        let labels: Vec<String> = object.labels.iter().map(u32::to_string).collect();
        if labels.is_empty() { "none".to_owned() } else { labels.join(",") }
    });
    let objects = report.objects.iter().map(|(name, object)| (name.clone(), &object.mean));
    let means = [("mean of pairs", &report.mean.pairs), ("mean of objects", &report.mean.objects)];
    let means = means.map(|(name, scores)| (name.to_owned(), scores));
    let table = Table::new("object", &SCORE_COLUMNS, objects.chain(means)).with_text("labels", labels.collect());
    let mut parts = vec![Part::Title(format!("{}{compat}", report.protocol)), Part::Table(table)];
    let mut note = |text: String| parts.push(Part::Note(text));
    if report.lpips == "no weights" {
        note("LPIPS: no weights (see --lpips)".to_owned());
    }
    let head = &report.headline;
    note(format!("headline: {} {} over {}", head.key, number(head.iou, SCORE_DIGITS), head.average));
    note(format!("{} object-frame pairs", report.mean.pair_count));
    report.rules.iter().for_each(|rule| note(format!("rule: {rule}")));
    report.missing.iter().for_each(|absent| note(absence("missing", absent)));
    report.empty.iter().for_each(|absent| note(absence("empty", absent)));
    report.left_out.iter().for_each(|what| note(format!("left out: {what}")));
    Parts(parts)
}

fn absence(kind: &str, absent: &MissingPrediction) -> String {
    let frame = absent.frame.as_ref().map_or(String::new(), |frame| format!(" in {frame}"));
    format!("{kind}: {}{frame}: {}", absent.object, absent.reason)
}
