//! Rows of trainings as a table and a chart: a line for each kind and length, means over seeds with their range.

use super::rows::Row;
use labelgs::{Error, Result};
use plotters::prelude::*;
use std::collections::BTreeMap;

/// Colours by kind.
const COLOURS: [RGBColor; 5] = [
    RGBColor(90, 90, 90),
    RGBColor(31, 119, 180),
    RGBColor(214, 120, 20),
    RGBColor(190, 40, 60),
    RGBColor(60, 140, 60),
];

/// All seeds of a scene, a kind and a length.
struct Group<'a> {
    scene: &'a str,
    kind: &'a str,
    steps: u32,
    rows: Vec<&'a Row>,
}

impl Group<'_> {
    fn values(&self, of: impl Fn(&Row) -> Option<f64>) -> Vec<f64> {
        self.rows.iter().filter_map(|row| of(row)).collect()
    }

    fn mean(&self, of: impl Fn(&Row) -> Option<f64>) -> Option<f64> {
        let values = self.values(of);
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// Mean, least and most.
    fn cell(&self, digits: usize, of: impl Fn(&Row) -> Option<f64>) -> String {
        let values = self.values(of);
        if values.is_empty() {
            return "-".to_owned();
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        match values.len() {
            1 => format!("{mean:.digits$}"),
            _ => format!("{mean:.digits$} ({least:.digits$} to {most:.digits$})"),
        }
    }
}

/// Groups in the order of their first rows.
fn groups(rows: &[Row]) -> Vec<Group<'_>> {
    let mut found: Vec<Group> = Vec::new();
    for row in rows {
        let key = (row.scene.as_str(), row.program.as_str(), row.steps);
        match found.iter_mut().find(|group| (group.scene, group.kind, group.steps) == key) {
            Some(group) => group.rows.push(row),
            None => found.push(Group { scene: key.0, kind: key.1, steps: key.2, rows: vec![row] }),
        }
    }
    found
}

/// The score that decides: PSNR where training can know the picture, else over whole views.
fn score(row: &Row) -> Option<f64> {
    row.psnr_seen.or(Some(row.psnr))
}

/// (CPU seconds, score) of a kind on a scene, by length.
fn curve(groups: &[Group], scene: &str, kind: &str) -> Vec<(f64, f64)> {
    let own = groups.iter().filter(|group| (group.scene, group.kind) == (scene, kind));
    let mut curve: Vec<(f64, f64)> =
        own.filter_map(|group| Some((group.mean(|row| Some(row.cpu))?, group.mean(score)?))).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    curve
}

/// CPU seconds at which a curve first reaches a score, linear in the logarithm of time; none if it never does.
pub fn reached(curve: &[(f64, f64)], score: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for &(cpu, found) in curve {
        if found >= score {
            let Some((from, low)) = before else { return Some(cpu) };
            let part = ((score - low) / (found - low)).clamp(0.0, 1.0);
            return Some((from.ln() + part * (cpu.ln() - from.ln())).exp());
        }
        before = Some((cpu, found));
    }
    None
}

/// The table. The last column is the time in which a kind reaches the longest training of `other`, relative to it.
pub fn table_of(rows: &[Row], other: &str) -> Vec<Vec<String>> {
    let groups = groups(rows);
    let head = [
        "scene",
        "training",
        "steps",
        "CPU s",
        "Gaussians",
        "PSNR",
        "PSNR seen",
        "worst view",
        "SSIM",
        "IoU map",
        "IoU object",
        "time to other's",
    ];
    let mut table = vec![head.map(str::to_owned).to_vec()];
    for group in &groups {
        let goal = curve(&groups, group.scene, other).last().copied();
        let own = curve(&groups, group.scene, group.kind);
        let is_last = own.last().map(|end| end.0) == group.mean(|row| Some(row.cpu));
        let ratio = match goal {
            Some((cpu, score)) if is_last && group.kind != other => {
                reached(&own, score).map_or("not reached".to_owned(), |own| format!("{:.2}", own / cpu))
            }
            _ => String::new(),
        };
        table.push(vec![
            group.scene.to_owned(),
            group.kind.to_owned(),
            group.steps.to_string(),
            group.cell(0, |row| Some(row.cpu)),
            group.cell(0, |row| Some(row.gaussians as f64)),
            group.cell(2, |row| Some(row.psnr)),
            group.cell(2, |row| row.psnr_seen),
            group.cell(2, |row| Some(row.worst)),
            group.cell(4, |row| Some(row.ssim)),
            group.cell(3, |row| row.iou_map),
            group.cell(3, |row| row.iou_object),
            ratio,
        ]);
    }
    table
}

/// The chart: a panel for each scene, score over CPU seconds.
pub fn chart(rows: &[Row]) -> Result<String> {
    let mut text = String::new();
    draw(&mut text, rows).map_err(|error| Error::Bug(format!("the chart cannot be drawn: {error}")))?;
    Ok(text)
}

fn draw(text: &mut String, rows: &[Row]) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let groups = groups(rows);
    let mut panels: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for group in &groups {
        let kinds = panels.entry(group.scene).or_default();
        if !kinds.contains(&group.kind) {
            kinds.push(group.kind);
        }
    }
    let columns = panels.len().min(2);
    let lines = panels.len().div_ceil(columns.max(1));
    let root = SVGBackend::with_string(text, (560 * columns as u32, 400 * lines as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, (scene, kinds)) in root.split_evenly((lines, columns)).iter().zip(&panels) {
        let points = groups.iter().filter(|group| group.scene == *scene).flat_map(|group| &group.rows);
        let mut seconds = (f64::INFINITY, 0.0_f64);
        let mut scores = (f64::INFINITY, f64::NEG_INFINITY);
        for row in points {
            let score = score(row).unwrap_or(row.psnr);
            (seconds.0, seconds.1) = (seconds.0.min(row.cpu), seconds.1.max(row.cpu));
            (scores.0, scores.1) = (scores.0.min(score), scores.1.max(score));
        }
        let margin = 0.05 * (scores.1 - scores.0).max(0.1);
        let mut chart = ChartBuilder::on(area)
            .caption(scene, ("sans-serif", 18))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(48)
            .build_cartesian_2d(
                (0.9 * seconds.0..1.1 * seconds.1.max(seconds.0 + 1.0)).log_scale(),
                scores.0 - margin..scores.1 + margin,
            )?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc("CPU seconds")
            .y_desc("PSNR where three training views see, dB")
            .draw()?;
        for (kind, colour) in kinds.iter().zip(COLOURS.iter().cycle()) {
            let line = LineSeries::new(curve(&groups, scene, kind), colour.stroke_width(2));
            let legend = move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2));
            chart.draw_series(line)?.label(*kind).legend(legend);
            let own = groups.iter().filter(|group| (group.scene, group.kind) == (*scene, *kind));
            let dots = own.flat_map(|group| &group.rows).filter_map(|row| Some((row.cpu, score(row)?)));
            chart.draw_series(dots.map(|at| Circle::new(at, 3, colour.filled())))?;
        }
        let mut legend = chart.configure_series_labels();
        legend.border_style(BLACK.mix(0.3)).background_style(WHITE.mix(0.8));
        legend.position(SeriesLabelPosition::LowerRight).draw()?;
    }
    root.present()?;
    Ok(())
}
