//! The Pareto front of modes, and its knee. Differences within noise are ignored.

use super::measure::{ModeResult, SceneResult};

/// A measure of error that a chart shows.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Name.
    pub name: &'static str,
    /// Its value for a mode.
    pub of: fn(&ModeResult) -> f64,
}

/// The four measures, in the order of the chart's panels. Where a cut-off changes which pairs count, small elements of
/// gradients have any relative error, and only the norm says something.
pub const MEASURES: [Measure; 4] = [
    Measure { name: "colours, 99.9 %, no cut-offs", of: |mode| mode.against_no_cut_offs.colours.p999 },
    Measure { name: "gradients, norm, no cut-offs", of: |mode| mode.against_no_cut_offs.gradients.worst.rms },
    Measure { name: "colours, 99.9 %, same rules", of: |mode| mode.against_rules.colours.p999 },
    Measure { name: "gradients, 99.9 % relative, same rules", of: |mode| mode.against_rules.gradients.worst.p999 },
];

/// A difference of relative time that is noise.
const NOISE: f64 = 0.04;
/// A factor between errors that is negligible.
const ALIKE: f64 = 1.25;

/// Time and error of the modes.
struct Points(Vec<(f64, f64)>);

impl Points {
    fn of(scene: &SceneResult, measure: Measure) -> Self {
        let error =
            |mode| Some((measure.of)(mode)).filter(|error| error.is_finite()).unwrap_or(f64::INFINITY).max(1e-9);
        Self(scene.modes.iter().map(|mode| (mode.relative_time, error(mode))).collect())
    }

    /// Neither slower nor less accurate, and clearly better in one of the two.
    fn beats(&self, a: usize, b: usize) -> bool {
        let ((time_a, error_a), (time_b, error_b)) = (self.0[a], self.0[b]);
        let not_worse = time_a <= time_b + NOISE && error_a <= error_b * ALIKE;
        not_worse && (time_a < time_b - NOISE || error_a * ALIKE < error_b)
    }

    /// Equal within noise.
    fn tie(&self, a: usize, b: usize) -> bool {
        let ((time_a, error_a), (time_b, error_b)) = (self.0[a], self.0[b]);
        (time_a - time_b).abs() <= NOISE && error_a <= error_b * ALIKE && error_b <= error_a * ALIKE
    }

    /// Modes that no other beats, fastest first; of the default and its ties the default alone.
    fn front(&self) -> Vec<usize> {
        let all = 0..self.0.len();
        let stays = |&b: &usize| (b == 0 || !self.tie(b, 0)) && !all.clone().any(|a| self.beats(a, b));
        let mut front: Vec<usize> = all.clone().filter(stays).collect();
        front.sort_by(|&a, &b| self.0[a].0.total_cmp(&self.0[b].0));
        front
    }

    /// The mode of a front that lies farthest below the straight line between the front's ends, with the error on a
    /// logarithmic axis.
    fn knee(&self, front: &[usize]) -> Option<usize> {
        let point = |&i: &usize| (self.0[i].0, self.0[i].1.ln());
        let (first, last) = (point(front.first()?), point(front.last()?));
        let below = |i: &usize| {
            let (x, y) = point(i);
            let (width, height) = ((last.0 - first.0).abs().max(1e-9), (first.1 - last.1).abs().max(1e-9));
            1.0 - (x - first.0) / width - (y - last.1) / height
        };
        front.iter().copied().max_by(|a, b| below(a).total_cmp(&below(b)))
    }
}

/// Front and knee of each measure, in words.
pub fn all(scene: &SceneResult) -> Vec<(&'static str, String)> {
    let names = |modes: &[usize]| modes.iter().map(|&i| scene.modes[i].name).collect::<Vec<_>>().join(", ");
    let one = |measure: Measure| {
        let points = Points::of(scene, measure);
        let front = points.front();
        let knee = points.knee(&front)?;
        let ties: Vec<usize> = (1..scene.modes.len()).filter(|&i| points.tie(i, 0)).collect();
        Some((
            measure.name,
            format!("unbeaten {}; knee {}; like the default {}", names(&front), names(&[knee]), names(&ties)),
        ))
    };
    MEASURES.into_iter().filter_map(one).collect()
}
