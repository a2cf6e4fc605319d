//! Scores of a benchmark as text.

use crate::cli::support::scoring::number;
use crate::eval::protocol::report::{Absent, Report};
use crate::eval::protocol::score::PairScores;

/// Returns the table of objects with averages, then everything that is missing.
pub(super) fn table(report: &Report) -> String {
    let names = report.objects.keys().map(String::len);
    let wide = names.chain(["mean of objects".len()]).max().unwrap_or_default();
    let row = |name: &str, scores: &PairScores, labels: &str| {
        let cells = [
            number(scores.iou, 4),
            number(scores.iou_colour, 4),
            number(scores.boundary_iou, 4),
            number(scores.accuracy, 4),
            number(scores.psnr, 2),
            number(scores.ssim, 4),
            if report.lpips == "no weights" { "no weights".to_owned() } else { number(scores.lpips, 4) },
        ];
        let [iou, colour, rim, accuracy, psnr, ssim, lpips] = cells;
        format!(
            "{name:>wide$} {iou:>8} {colour:>10} {rim:>12} {accuracy:>8} {psnr:>7} {ssim:>7} {lpips:>10}  {labels}\n"
        )
    };
    let compat = if report.compat { ", by the published scorer's ways" } else { "" };
    let mut text = format!("{}{compat}\n", report.protocol);
    text += &format!(
        "{:>wide$} {:>8} {:>10} {:>12} {:>8} {:>7} {:>7} {:>10}  labels\n",
        "object", "iou", "iou_colour", "boundary_iou", "accuracy", "psnr", "ssim", "lpips"
    );
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
    report.missing.iter().for_each(|absent| text += &line("missing", absent));
    report.empty.iter().for_each(|absent| text += &line("empty", absent));
    report.left_out.iter().for_each(|what| text += &format!("left out: {what}\n"));
    text
}

fn line(kind: &str, absent: &Absent) -> String {
    let frame = absent.frame.as_ref().map_or(String::new(), |frame| format!(" in {frame}"));
    format!("{kind}: {}{frame}: {}\n", absent.object, absent.reason)
}
