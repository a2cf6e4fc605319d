//! Curves over steps, as SVG with labels in HTML, so that their type keeps its size on a narrow screen.

use super::axis::{Axis, Scale};
use super::series::{Series, thinned};
use super::text::{count, number, significant};
use maud::{Markup, html};
use std::fmt::Write;

/// Colours of the style sheet.
const COLOUR_COUNT: usize = 8;
/// Maximum number of points of a curve to draw dots for.
const DOTS_MAX: usize = 24;

/// Returns the class of a colour.
pub fn colour_class(colour: usize) -> String {
    format!("c{}", colour % COLOUR_COUNT)
}

/// A vertical mark.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Step.
    pub step: f64,
    /// Text of the event.
    pub text: String,
    /// Number of a run's colour if it is of one of several runs.
    pub colour: Option<usize>,
}

/// How the values of a chart are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Digits {
    /// Three significant digits.
    #[default]
    Significant,
    /// As many digits after the point.
    Fixed(usize),
    /// Whole numbers.
    Count,
}

impl Digits {
    fn text(self, value: f64) -> String {
        match self {
            Self::Significant => significant(value),
            Self::Fixed(digits) => number(Some(value), digits),
            Self::Count => count(value.round().max(0.0) as u64),
        }
    }
}

/// An image of curves.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Note below the title.
    pub note: String,
    /// Curves.
    pub series: Vec<Series>,
    /// Events, by rising step. Their numbers are their places, from 1 on.
    pub marks: Vec<Mark>,
    /// Adds a legend of the numbered events.
    pub has_legend: bool,
    /// The axis of the values.
    pub scale: Scale,
    /// Minimum range of a linear axis, so that small changes look small.
    pub least_span: f64,
    /// Largest possible value.
    pub ceiling: Option<f64>,
    /// Style of the values.
    pub digits: Digits,
}

impl Chart {
    /// Returns the chart; nothing without points.
    pub fn markup(&self) -> Markup {
        let is_shown = |point: &(f64, f64)| self.scale != Scale::Logarithmic || point.1 > 0.0;
        let shown = |series: &Series| Series {
            points: series.points.iter().copied().filter(is_shown).collect(),
            ..series.clone()
        };
        let mut series: Vec<Series> = self.series.iter().map(shown).collect();
        series.retain(|series| !series.points.is_empty());
        let series = thinned(&series);
        let ends = |value: fn(&(f64, f64)) -> f64| {
            let values = series.iter().flat_map(|series| &series.points).map(value);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        if series.is_empty() {
            return html! {};
        }
        let mut named: Vec<&Series> = Vec::new();
        for one in &series {
            if named.iter().all(|other| other.name != one.name) {
                named.push(one);
            }
        }
        let ((first, last), values) = (ends(|point| point.0), ends(|point| point.1));
        let x = Axis::new(first.min(0.0), last, false);
        let y = self.values(values);
        html! {
            figure.chart {
                figcaption {
                    strong { (self.title) }
                    @if !self.note.is_empty() { " " span.quiet { (self.note) } }
                    @if named.len() > 1 {
                        ul.legend { @for series in &named { li { i class=(colour_class(series.colour)) {} (series.name) } } }
                    }
                    @if self.has_legend { (legend(&self.marks, &x)) }
                }
                (self.plot(&series, &x, &y))
            }
        }
    }

    /// The axis of the values.
    fn values(&self, (low, high): (f64, f64)) -> Axis {
        if self.scale == Scale::Logarithmic {
            return Axis::logarithmic(low, high);
        }
        let low = if self.scale == Scale::FromZero { low.min(0.0) } else { low };
        let room = 0.5 * (self.least_span - (high - low)).max(0.0);
        // A range above the ceiling is moved below it.
        let over = self.ceiling.map_or(0.0, |ceiling| (high + room - ceiling.max(high)).max(0.0));
        Axis::new(low - room - over, high + room - over, true)
    }

    fn plot(&self, series: &[Series], x: &Axis, y: &Axis) -> Markup {
        let percent = |place: f64| format!("{:.2}%", 100.0 * place);
        html! {
            div.plot {
                @for &tick in &y.ticks {
                    i.rule style=(format!("bottom:{}", percent(y.place(tick)))) {}
                    span.y style=(format!("bottom:{}", percent(y.place(tick)))) { (y.text(tick)) }
                }
                @for &tick in &x.ticks { span.x style=(format!("left:{}", percent(x.place(tick)))) { (x.text(tick)) } }
                @for (number, mark) in (1..).zip(&self.marks) { (line(mark, number, x)) }
                svg viewBox="0 0 1000 1000" preserveAspectRatio="none" role="img" aria-label=(self.title) {
                    @for series in series { (self.curve(series, x, y)) }
                }
                div.readout hidden {}
            }
        }
    }

    /// A curve, with its steps and values as texts for who points at it.
    fn curve(&self, series: &Series, x: &Axis, y: &Axis) -> Markup {
        let (mut points, mut values, mut dots) = (String::new(), String::new(), String::new());
        for &(at, value) in &series.points {
            let (left, top) = (1000.0 * x.place(at), 1000.0 * (1.0 - y.place(value)));
            // Writing to a String cannot fail.
            let _ = write!(points, "{left:.1},{top:.1} ");
            let _ = write!(values, "{at}:{} ", self.digits.text(value));
            // A round cap makes a dot of a line without length.
            let _ = write!(dots, "M{left:.1} {top:.1}h.01");
        }
        let class = colour_class(series.colour);
        html! {
            polyline class=(class) data-name=(series.name) data-values=(values.trim_end()) points=(points.trim_end()) {}
            @if series.points.len() <= DOTS_MAX { path class=(format!("dots {class}")) d=(dots) {} }
        }
    }
}

fn is_inside(mark: &Mark, x: &Axis) -> bool {
    (0.0..=1.0).contains(&x.place(mark.step))
}

/// The line of an event with its number.
fn line(mark: &Mark, number: usize, x: &Axis) -> Markup {
    let class = mark.colour.map(colour_class).unwrap_or_default();
    html! {
        @if is_inside(mark, x) {
            span class=(format!("mark {class}")) style=(format!("left:{:.2}%", 100.0 * x.place(mark.step))) title=(mark.text) {
                b { (number) }
            }
        }
    }
}

/// The legend of the numbered events.
fn legend(marks: &[Mark], x: &Axis) -> Markup {
    html! {
        @if marks.iter().any(|mark| is_inside(mark, x)) {
            ul.legend.events {
                @for (number, mark) in (1..).zip(marks).filter(|(_, mark)| is_inside(mark, x)) {
                    li { b class=(mark.colour.map(colour_class).unwrap_or_default()) { (number) } " " (mark.text) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(chart: &Chart, values: (f64, f64)) -> (f64, f64) {
        let axis = chart.values(values);
        (axis.low, axis.high)
    }

    #[test]
    fn small_changes_stay_small_and_below_the_ceiling() {
        let chart = Chart { least_span: 0.1, ceiling: Some(1.0), ..Chart::default() };
        let (low, high) = axis(&chart, (0.98, 0.982));
        assert!((low - 0.9).abs() < 1e-9 && (high - 1.0).abs() < 1e-9, "{low} {high}");
        let (low, high) = axis(&chart, (0.2, 0.8));
        assert!(low <= 0.2 && low > 0.0 && (0.8..=1.0).contains(&high), "{low} {high}");
        assert_eq!(axis(&Chart { scale: Scale::FromZero, ..Chart::default() }, (4.0, 10.0)), (0.0, 10.0));
    }

    #[test]
    fn values_are_told_as_they_are_and_events_by_number() {
        let series = Series::new("loss", 0, [(10.0, 0.123_456), (20.0, 0.0), (30.0, 0.012_345)]);
        let marks = [5.0, 40.0].map(|step| Mark { step, text: format!("event {step}"), colour: None });
        let chart = Chart {
            series: vec![series],
            marks: marks.to_vec(),
            has_legend: true,
            scale: Scale::Logarithmic,
            ..Chart::default()
        };
        let text = chart.markup().into_string();
        assert!(text.contains("data-values=\"10:0.123 30:0.0123\""), "{text}");
        assert!(text.contains("event 5") && !text.contains("event 40"), "{text}");
        assert_eq!(text.matches("M").count(), 2, "two dots: {text}");
        assert_eq!(Chart::default().markup().into_string(), "");
    }
}
