//! Curves of all kinds of training: median over seeds, with the range as a band.

use super::curve::{Curve, Sample};
use super::names;
use crate::measure::{median, write_text};
use labelgs::{Error, Result};
use plotters::prelude::*;
use std::path::Path;

/// Colours by kind.
const COLOURS: [RGBColor; 4] =
    [RGBColor(90, 90, 90), RGBColor(31, 119, 180), RGBColor(214, 120, 20), RGBColor(190, 40, 60)];
/// A panel: its name and its value.
const PANELS: [(&str, fn(&Sample) -> Option<f64>); 4] = [
    ("PSNR, dB", |sample| sample.psnr),
    ("SSIM", |sample| sample.ssim),
    ("IoU of the label map", |sample| sample.iou_map),
    ("IoU of objects alone", |sample| sample.iou_object),
];

/// Second, least, median, most.
type Band = Vec<(f64, [f64; 3])>;

/// Writes the chart.
pub fn write(path: &Path, curves: &[Curve]) -> Result<()> {
    let mut text = String::new();
    draw(&mut text, curves).map_err(|error| Error::Bug(format!("the chart cannot be drawn: {error}")))?;
    write_text(path, &text)
}

fn draw(text: &mut String, curves: &[Curve]) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(text, (1100, 800)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, (name, of)) in root.split_evenly((2, 2)).iter().zip(PANELS) {
        let bands: Vec<Band> = names().map(|kind| band(curves, kind, of)).collect();
        let points = || bands.iter().flatten();
        let seconds = range(points().map(|(second, _)| *second)).unwrap_or((1.0, 10.0));
        let scores = range(points().flat_map(|(_, scores)| *scores)).unwrap_or((0.0, 1.0));
        let margin = 0.05 * (scores.1 - scores.0).max(1e-3);
        let mut chart = ChartBuilder::on(area)
            .caption(name, ("sans-serif", 18))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(48)
            .build_cartesian_2d(
                (seconds.0..seconds.1.max(seconds.0 * 1.01)).log_scale(),
                scores.0 - margin..scores.1 + margin,
            )?;
        chart.configure_mesh().light_line_style(WHITE).x_desc("seconds of training").draw()?;
        for ((band, kind), colour) in bands.iter().zip(names()).zip(COLOURS) {
            if band.is_empty() {
                continue;
            }
            let low = band.iter().map(|(second, scores)| (*second, scores[0]));
            let high = band.iter().rev().map(|(second, scores)| (*second, scores[2]));
            chart.draw_series([Polygon::new(low.chain(high).collect::<Vec<_>>(), colour.mix(0.15))])?;
            let middle = band.iter().map(|(second, scores)| (*second, scores[1]));
            chart
                .draw_series(LineSeries::new(middle, colour.stroke_width(2)))?
                .label(kind)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        }
        let mut legend = chart.configure_series_labels();
        legend.border_style(BLACK.mix(0.3)).background_style(WHITE.mix(0.8));
        legend.position(SeriesLabelPosition::LowerRight).draw()?;
    }
    root.present()?;
    Ok(())
}

/// Medians over seeds at the samples that all seeds have: the marks, and the end.
fn band(curves: &[Curve], kind: &str, of: fn(&Sample) -> Option<f64>) -> Band {
    let of_kind: Vec<&Curve> = curves.iter().filter(|curve| curve.kind == kind).collect();
    let shared = of_kind.iter().map(|curve| curve.samples.len()).min().unwrap_or(0);
    let at = |index: usize| {
        let from_end = shared - index;
        // Counted from the end where it is the last: seeds may differ by a mark.
        let pick = |curve: &&Curve| {
            let place = if from_end == 1 { curve.samples.len() - 1 } else { index };
            let sample = &curve.samples[place];
            Some((sample.seconds, of(sample)?))
        };
        let found: Vec<(f64, f64)> = of_kind.iter().map(pick).collect::<Option<_>>()?;
        let (least, most) = range(found.iter().map(|(_, score)| *score))?;
        let second = median(found.iter().map(|(second, _)| *second));
        Some((second, [least, median(found.iter().map(|(_, score)| *score)), most]))
    };
    (0..shared).filter_map(at).collect()
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| {
        let (least, most) = found.unwrap_or((value, value));
        Some((f64::min(least, value), f64::max(most, value)))
    })
}
