//! Curves over steps, as SVG with labels in HTML, so that their type keeps its size on a narrow screen.

use super::axis::Axis;
use super::series::Series;
use maud::{Markup, html};
use std::fmt::Write;

/// Colours of the style sheet.
const COLOURS: usize = 8;

/// Returns the class of a colour.
pub fn colour_class(colour: usize) -> String {
    format!("c{}", colour % COLOURS)
}

/// A vertical mark.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Step.
    pub step: f64,
    /// What happened.
    pub text: String,
    /// Number of a run's colour if there are several runs.
    pub colour: Option<usize>,
}

/// A picture of curves.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Note below the title.
    pub note: String,
    /// Curves.
    pub series: Vec<Series>,
    /// Events.
    pub marks: Vec<Mark>,
    /// The axis starts at 0.
    pub from_zero: bool,
}

impl Chart {
    /// Returns the chart; nothing without points.
    pub fn markup(&self) -> Markup {
        let series: Vec<&Series> = self.series.iter().filter(|series| !series.points.is_empty()).collect();
        let thinned: Vec<Vec<(f64, f64)>> = series.iter().map(|series| series.thinned()).collect();
        let ends = |value: fn(&(f64, f64)) -> f64| {
            let values = thinned.iter().flatten().map(value);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        if thinned.is_empty() {
            return html! {};
        }
        // Curves of one colour belong together, and the first of them names them.
        let is_named = |at: usize| !series[..at].iter().any(|before| before.colour == series[at].colour);
        let named: Vec<&Series> = (0..series.len()).filter(|&at| is_named(at)).map(|at| series[at]).collect();
        let ((first, last), (low, high)) = (ends(|point| point.0), ends(|point| point.1));
        let x = Axis::new(first.min(0.0), last, false);
        let y = Axis::new(if self.from_zero { low.min(0.0) } else { low }, high, true);
        let percent = |place: f64| format!("{:.2}%", 100.0 * place);
        html! {
            figure.chart data-x=(format!("{} {}", x.low, x.high)) data-y=(format!("{} {}", y.low, y.high)) {
                figcaption {
                    strong { (self.title) }
                    @if !self.note.is_empty() { " " span.quiet { (self.note) } }
                    @if named.len() > 1 {
                        ul.legend { @for series in &named { li { i class=(colour_class(series.colour)) {} (series.name) } } }
                    }
                }
                div.plot {
                    @for &tick in &y.ticks {
                        i.rule style=(format!("bottom:{}", percent(y.place(tick)))) {}
                        span.y style=(format!("bottom:{}", percent(y.place(tick)))) { (y.text(tick)) }
                    }
                    @for &tick in &x.ticks { span.x style=(format!("left:{}", percent(x.place(tick)))) { (x.text(tick)) } }
                    @for (index, mark) in self.marks.iter().enumerate() { (mark_markup(mark, index, x.place(mark.step))) }
                    svg viewBox="0 0 1000 1000" preserveAspectRatio="none" role="img" aria-label=(self.title) {
                        @for (series, points) in series.iter().zip(&thinned) {
                            (curve(series, points, &x, &y))
                        }
                    }
                    div.readout hidden {}
                }
            }
        }
    }
}

fn curve(series: &Series, points: &[(f64, f64)], x: &Axis, y: &Axis) -> Markup {
    let mut text = String::new();
    for (at, value) in points {
        // Writing to a String cannot fail.
        let _ = write!(text, "{:.1},{:.1} ", 1000.0 * x.place(*at), 1000.0 * (1.0 - y.place(*value)));
    }
    // A round cap makes a point of a curve with one point only.
    if let [(at, value)] = points {
        let _ = write!(text, "{:.1},{:.1}", 1000.0 * x.place(*at) + 0.1, 1000.0 * (1.0 - y.place(*value)));
    }
    let class = if points.len() == 1 { "dot " } else { "" }.to_owned() + &colour_class(series.colour);
    html! { polyline class=(class) data-name=(series.name) points=(text.trim_end()) {} }
}

/// A mark; texts stand in two lines in turn, because neighbours may be close.
fn mark_markup(mark: &Mark, index: usize, place: f64) -> Markup {
    if !(0.0..=1.0).contains(&place) {
        return html! {};
    }
    let class = mark.colour.map(colour_class).unwrap_or_default();
    let side = if place > 0.5 { " left" } else { "" };
    let line = if index % 2 == 1 { " low" } else { "" };
    html! {
        span class=(format!("mark{side}{line} {class}")) style=(format!("left:{:.2}%", 100.0 * place)) title=(mark.text) {
            @if mark.colour.is_none() { b { (mark.text) } }
        }
    }
}
