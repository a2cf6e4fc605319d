//! Time against error, a row of panels a scene.

use super::knee::{MEASURES, Measure};
use super::measure::SceneResult;
use super::modes::{Family, Mode};
use labelgs::{Error, Result};
use plotters::prelude::*;

const PANEL: (u32, u32) = (520, 400);
const LEGEND: u32 = 270;

fn colour(family: Family) -> RGBColor {
    match family {
        Family::Default => BLACK,
        Family::Stop => RGBColor(213, 94, 0),
        Family::Cut => RGBColor(0, 114, 178),
        Family::Arithmetic => RGBColor(130, 130, 130),
    }
}

/// The chart as the text of an SVG file.
pub fn svg(scenes: &[SceneResult], modes: &[Mode]) -> Result<String> {
    let shown: Vec<&SceneResult> = scenes.iter().filter(|scene| scene.name.starts_with('S')).collect();
    let size = (PANEL.0 * MEASURES.len() as u32 + LEGEND, PANEL.1 * shown.len().max(1) as u32);
    let mut text = String::new();
    draw(&mut text, size, &shown, modes).map_err(|error| Error::Bug(format!("chart: {error}")))?;
    Ok(text)
}

fn draw(
    text: &mut String,
    size: (u32, u32),
    scenes: &[&SceneResult],
    modes: &[Mode],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let (panels, legend) = root.split_horizontally(PANEL.0 * MEASURES.len() as u32);
    let panels = panels.split_evenly((scenes.len().max(1), MEASURES.len()));
    for (row, scene) in scenes.iter().enumerate() {
        for (column, measure) in MEASURES.into_iter().enumerate() {
            panel(&panels[row * MEASURES.len() + column], scene, measure, modes)?;
        }
    }
    for (number, mode) in modes.iter().enumerate() {
        let at = (4, 20 + 17 * number as i32);
        let style = ("sans-serif", 13).into_font().color(&colour(mode.family));
        legend.draw(&Text::new(format!("{number:>2}  {}", mode.name), at, style))?;
    }
    root.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn panel(
    area: &Area<'_>,
    scene: &SceneResult,
    measure: Measure,
    modes: &[Mode],
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let points: Vec<(usize, f64, f64)> = (scene.modes.iter().enumerate())
        .map(|(i, mode)| (i, mode.relative_time, (measure.of)(mode).max(1e-9)))
        .filter(|(_, time, error)| time.is_finite() && error.is_finite())
        .collect();
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)))
    };
    let (left, right) = ends(&mut points.iter().map(|point| point.1));
    let (low, high) = ends(&mut points.iter().map(|point| point.2));
    if points.is_empty() {
        return Ok(());
    }
    let margin = (right - left).max(0.05) * 0.08;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{}: {}", scene.name, measure.name), ("sans-serif", 16))
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(left - margin..right + margin, (low * 0.5..high * 2.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("time of a step relative to the default (processor time on a processor)")
        .y_label_formatter(&|value| format!("{value:.0e}"))
        .light_line_style(WHITE)
        .draw()?;
    for (number, time, error) in points {
        let family = modes.get(number).map_or(Family::Default, |mode| mode.family);
        let (radius, style) = if number == 0 { (6, 18) } else { (3, 12) };
        chart.draw_series([Circle::new((time, error), radius, colour(family).filled())])?;
        let text = if number == 0 { "default".to_owned() } else { number.to_string() };
        let style = ("sans-serif", style).into_font().color(&colour(family));
        chart.draw_series([EmptyElement::at((time, error)) + Text::new(text, (6, -6), style)])?;
    }
    Ok(())
}
