//! A curve, thinned so that its spikes stay.

/// Maximum number of points of a drawn curve.
pub const POINTS_MAX: usize = 600;

/// A named curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Number of its colour.
    pub colour: usize,
    /// Points by rising x.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// Makes a curve of the finite points.
    pub fn new(name: impl Into<String>, colour: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let points = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        Self { name: name.into(), colour, points }
    }

    /// Returns at most [`POINTS_MAX`] of the points: the least and the largest of each of equally long runs of points,
    /// with the first and the last point.
    fn thinned(&self) -> Vec<(f64, f64)> {
        let all = &self.points;
        let [first, inner @ .., last] = all.as_slice() else { return all.clone() };
        if all.len() <= POINTS_MAX {
            return all.clone();
        }
        let buckets = (POINTS_MAX - 2) / 2;
        let mut kept = vec![*first];
        for bucket in 0..buckets {
            let run = &inner[bucket * inner.len() / buckets..(bucket + 1) * inner.len() / buckets];
            let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let (least, most) = (run.iter().min_by(by_value), run.iter().max_by(by_value));
            let mut both: Vec<(f64, f64)> = least.into_iter().chain(most).copied().collect();
            both.sort_by(|a, b| a.0.total_cmp(&b.0));
            both.dedup();
            kept.extend(both);
        }
        kept.push(*last);
        kept
    }
}

/// Returns curves with the steps that any of them keeps, so that all have a value where one has.
pub fn thinned(all: &[Series]) -> Vec<Series> {
    let mut kept: Vec<f64> = all.iter().flat_map(Series::thinned).map(|point| point.0).collect();
    kept.sort_by(f64::total_cmp);
    let is_kept = |at: f64| kept.binary_search_by(|other| other.total_cmp(&at)).is_ok();
    let of = |series: &Series| {
        let points = series.points.iter().copied().filter(|point| is_kept(point.0)).collect();
        Series { points, ..series.clone() }
    };
    all.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_of_the_same_steps_keep_the_same() {
        let curve =
            |factor: f64| Series::new("a", 0, (0..5000).map(|at| (f64::from(at), (f64::from(at) * factor).sin())));
        let both = thinned(&[curve(0.3), curve(0.7)]);
        let steps = |index: usize| both[index].points.iter().map(|point| point.0).collect::<Vec<_>>();
        assert_eq!(steps(0), steps(1));
        assert!(steps(0).len() > POINTS_MAX && steps(0).len() <= 2 * POINTS_MAX, "{}", steps(0).len());
    }

    #[test]
    fn spikes_stay() {
        for length in [601, 1000, 3000, 100_000] {
            for spike in [1, length / 3, length / 2, length - 2] {
                let value = |index: usize| match index {
                    _ if index == spike => 9.0,
                    _ if index + 7 == spike => -9.0,
                    _ => (index as f64 * 0.01).sin(),
                };
                let series = Series::new("a", 0, (0..length).map(|index| (index as f64, value(index))));
                let thinned = series.thinned();
                assert!(thinned.len() <= POINTS_MAX && thinned.len() > POINTS_MAX / 2, "{}", thinned.len());
                assert!(thinned.contains(&(spike as f64, 9.0)), "{length} {spike}");
                assert!(spike < 8 || thinned.contains(&((spike - 7) as f64, -9.0)), "{length} {spike}");
                assert!(thinned.windows(2).all(|pair| pair[0].0 < pair[1].0), "in order, none twice");
                assert_eq!((thinned[0], thinned.last()), (series.points[0], series.points.last()));
            }
        }
    }

    #[test]
    fn few_points_stay_as_they_are_and_only_finite_ones_count() {
        let series = Series::new("a", 0, [(1.0, 2.0), (2.0, f64::NAN), (f64::INFINITY, 1.0), (3.0, 4.0)]);
        assert_eq!(series.thinned(), [(1.0, 2.0), (3.0, 4.0)]);
        assert_eq!(Series::new("a", 0, []).thinned(), []);
    }
}
