//! Scores of a benchmark as text.

use crate::cli::support::table::{Column, line, number, titles};
use crate::eval::protocol::report::{Absent, Report};
use crate::eval::protocol::score::PairScores;

const COLUMNS: [Column<PairScores>; 7] = [
    ("iou", 8, 4, |row| row.iou),
    ("iou_colour", 10, 4, |row| row.iou_colour),
    ("boundary_iou", 12, 4, |row| row.boundary_iou),
    ("accuracy", 8, 4, |row| row.accuracy),
    ("psnr", 7, 2, |row| row.psnr),
    ("ssim", 7, 4, |row| row.ssim),
    ("lpips", 10, 4, |row| row.lpips),
];

/// Returns the table of objects with averages, then everything that is missing.
pub(super) fn table(report: &Report) -> String {
    let names = report.objects.keys().map(String::len);
    let wide = names.chain(["mean of objects".len()]).max().unwrap_or_default();
    let row = |name: &str, scores: &PairScores, labels: &str| match report.lpips {
        "no weights" => format!("{} {:>10}  {labels}\n", line((name, wide), &COLUMNS[..6], scores), "no weights"),
        _ => format!("{}  {labels}\n", line((name, wide), &COLUMNS, scores)),
    };
    let compat = if report.compat { ", by the published scorer's ways" } else { "" };
    let mut text = format!("{}{compat}\n{}  labels\n", report.protocol, titles(("object", wide), &COLUMNS));
    for (name, object) in &report.objects {
        let labels: Vec<String> = object.labels.iter().map(u32::to_string).collect();
        text += &row(name, &object.mean, &if labels.is_empty() { "none".to_owned() } else { labels.join(",") });
    }
    text += &row("mean of pairs", &report.mean.pairs, "");
    text += &row("mean of objects", &report.mean.objects, "");
    let head = &report.headline;
    text += &format!("headline: {} {} over {}\n", head.key, number(head.iou, 4), head.average);
    text += &format!("{} pairs of object and frame\n", report.mean.pair_count);
    report.rules.iter().for_each(|rule| text += &format!("rule: {rule}\n"));
    report.missing.iter().for_each(|absent| text += &absence("missing", absent));
    report.empty.iter().for_each(|absent| text += &absence("empty", absent));
    report.left_out.iter().for_each(|what| text += &format!("left out: {what}\n"));
    text
}

fn absence(kind: &str, absent: &Absent) -> String {
    let frame = absent.frame.as_ref().map_or(String::new(), |frame| format!(" in {frame}"));
    format!("{kind}: {}{frame}: {}\n", absent.object, absent.reason)
}
