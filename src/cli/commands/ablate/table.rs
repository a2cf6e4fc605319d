//! The table of an ablation: a row per variant with the mean over its seeds, and their spread if there are several.

use super::Outcome;

/// A column: title, digits, value of a run.
type Column = (&'static str, usize, fn(&Outcome) -> Option<f64>);

const OUTCOME_COLUMNS: [Column; 10] = [
    ("PSNR", 2, |run| run.scores.psnr),
    ("SSIM", 4, |run| run.scores.ssim),
    ("iou_map", 4, |run| run.scores.objects.iou_map),
    ("iou_object", 4, |run| run.scores.objects.iou_object),
    ("iou_hidden", 4, |run| run.scores.objects.iou_hidden),
    ("psnr_hidden", 2, |run| run.scores.objects.psnr_hidden),
    ("paper mIoU", 4, |run| run.scores.objects.paper_iou),
    ("object PSNR", 2, |run| run.scores.objects.object_psnr),
    ("Gaussians", 0, |run| Some(f64::from(run.gaussians))),
    ("seconds", 1, |run| Some(run.seconds)),
];

/// Returns the table as text.
pub(super) fn table(rows: &[(&str, &[Outcome])]) -> String {
    let several = rows.iter().any(|(_, runs)| runs.len() > 1);
    let width = if several { 17 } else { 12 };
    let mut text = format!("{:>24}", "variant");
    OUTCOME_COLUMNS.iter().for_each(|(title, ..)| text += &format!(" {title:>width$}"));
    for (name, runs) in rows {
        text += &format!("\n{name:>24}");
        for (_, digits, value) in OUTCOME_COLUMNS {
            let values: Vec<f64> = runs.iter().filter_map(value).collect();
            text += &format!(" {:>width$}", cell(&values, digits));
        }
    }
    text + if several { "\nmean ± half of the range over the seeds\n" } else { "\n" }
}

fn cell(values: &[f64], digits: usize) -> String {
    let Some(highest) = values.iter().copied().reduce(f64::max) else { return "-".to_owned() };
    let lowest = values.iter().copied().fold(highest, f64::min);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    match values.len() {
        1 => format!("{mean:.digits$}"),
        _ => format!("{mean:.digits$} ± {:.digits$}", 0.5 * (highest - lowest)),
    }
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn cells_hold_mean_and_half_range() {
        assert_eq!(cell(&[], 2), "-");
        assert_eq!(cell(&[1.256], 2), "1.26");
        assert_eq!(cell(&[1.0, 2.0, 3.0], 1), "2.0 ± 1.0");
    }
}
