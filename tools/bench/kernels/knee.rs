//! Which modes nothing else beats, and which of them is the knee.

use super::errors::Errors;
use super::measure::{ModeResult, SceneResult};

/// A measure of error that a chart shows.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Name.
    pub name: &'static str,
    /// Its value for a mode.
    pub of: fn(&ModeResult) -> Option<f64>,
}

fn colour(errors: Option<&Errors>) -> Option<f64> {
    errors.map(|errors| errors.colours.p999)
}

/// Where a cut-off changes which pairs count, small elements have any relative error, and only the norm says something.
fn norm(errors: Option<&Errors>) -> Option<f64> {
    errors.map(|errors| errors.gradients.worst.rms)
}

fn relative(errors: Option<&Errors>) -> Option<f64> {
    errors.map(|errors| errors.gradients.worst.p999)
}

/// The four measures, in the order of the chart's panels.
pub const MEASURES: [Measure; 4] = [
    Measure { name: "colours, 99.9 %, no cut-offs", of: |mode| colour(mode.against_no_cut_offs.as_ref()) },
    Measure { name: "gradients, norm, no cut-offs", of: |mode| norm(mode.against_no_cut_offs.as_ref()) },
    Measure { name: "colours, 99.9 %, same rules", of: |mode| colour(mode.against_rules.as_ref()) },
    Measure { name: "gradients, 99.9 % relative, same rules", of: |mode| relative(mode.against_rules.as_ref()) },
];

/// A difference of time that is noise.
const NOISE: f64 = 0.02;

/// Numbers of the modes that no other beats in time (beyond noise) without a larger error, fastest first.
pub fn front(scene: &SceneResult, measure: Measure) -> Vec<usize> {
    let points: Vec<(f64, f64)> =
        scene.modes.iter().map(|mode| (mode.relative_time, (measure.of)(mode).unwrap_or(f64::INFINITY))).collect();
    let beaten = |i: usize| {
        points.iter().enumerate().any(|(j, other)| {
            let (time, error) = points[i];
            j != i && other.0 <= time + NOISE && other.1 <= error && (other.0 < time - NOISE || other.1 < 0.8 * error)
        })
    };
    let mut front: Vec<usize> = (0..points.len()).filter(|&i| points[i].1.is_finite() && !beaten(i)).collect();
    front.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0));
    front
}

/// The mode of the front that lies farthest below the straight line between the front's ends, with the error on a
/// logarithmic axis.
pub fn knee(scene: &SceneResult, measure: Measure) -> Option<usize> {
    let front = front(scene, measure);
    let point = |&i: &usize| {
        let mode = &scene.modes[i];
        (mode.relative_time, (measure.of)(mode).unwrap_or(f64::INFINITY).max(1e-9).ln())
    };
    let (first, last) = (point(front.first()?), point(front.last()?));
    let below = |i: &usize| {
        let (x, y) = point(i);
        let (width, height) = ((last.0 - first.0).abs().max(1e-9), (first.1 - last.1).abs().max(1e-9));
        1.0 - (x - first.0) / width - (y - last.1) / height
    };
    front.iter().copied().max_by(|a, b| below(a).total_cmp(&below(b)))
}

/// The front and the knee of each measure, in words.
pub fn all(scene: &SceneResult) -> Vec<(&'static str, String)> {
    let name = |&i: &usize| scene.modes[i].name;
    let one = |measure: Measure| {
        let front = front(scene, measure);
        let knee = knee(scene, measure)?;
        let names: Vec<&str> = front.iter().map(name).collect();
        Some((measure.name, format!("unbeaten {}; knee: {}", names.join(", "), name(&knee))))
    };
    MEASURES.into_iter().filter_map(one).collect()
}
