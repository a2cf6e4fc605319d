//! The colours of what strokes hit, and which of them a Gaussian has most.

use glam::DVec3;

/// Most colours of a label.
const COLOURS: usize = 16;
/// Distance, of colours from 0 to 1, from which two are different ones.
const DISTANCE_MIN: f64 = 0.01;
/// Rounds of the means.
const ROUNDS: usize = 10;
/// Noise of a colour: where colours differ by less, they tell nothing.
const NOISE: f64 = 0.03;

/// The colours of a label.
#[derive(Clone, Debug, Default)]
pub(super) struct Palette(Vec<DVec3>);

impl Palette {
    /// Finds the means of groups of colours: k-means, which starts at the colours that are farthest from all before.
    pub(super) fn new(colours: &[DVec3]) -> Self {
        let Some(mean) = (!colours.is_empty()).then(|| colours.iter().sum::<DVec3>() / colours.len() as f64) else {
            return Self::default();
        };
        let mut palette = Self(vec![mean]);
        let mut distances = vec![f64::INFINITY; colours.len()];
        while let Some(&last) = palette.0.last() {
            let nearer = distances.iter_mut().zip(colours);
            nearer.for_each(|(distance, colour)| *distance = distance.min(colour.distance(last)));
            let farthest = distances.iter().zip(colours).max_by(|a, b| a.0.total_cmp(b.0));
            match farthest {
                Some((&distance, &colour)) if palette.0.len() < COLOURS && distance >= DISTANCE_MIN => {
                    palette.0.push(colour);
                }
                _ => break,
            }
        }
        for _ in 0..ROUNDS {
            let mut sums = vec![(DVec3::ZERO, 0.0); palette.0.len()];
            for &colour in colours {
                let (sum, count) = &mut sums[palette.nearest(colour).0];
                *sum += colour;
                *count += 1.0;
            }
            let means = sums.into_iter().filter(|(_, count)| *count > 0.0);
            palette.0 = means.map(|(sum, count)| sum / count).collect();
        }
        palette
    }

    /// Returns the colour that is nearest to one, and the distance.
    fn nearest(&self, colour: DVec3) -> (usize, f64) {
        let squares = self.0.iter().map(|own| own.distance_squared(colour)).enumerate();
        let nearest = squares.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
        (nearest.0, nearest.1.sqrt())
    }

    /// Returns how far a colour is from those of the label, never 0; infinite without any.
    pub(super) fn distance(&self, colour: DVec3) -> f64 {
        self.nearest(colour).1 + NOISE
    }
}

/// The two labels to which something is nearest, by any distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    label: usize,
    first: f64,
    second: f64,
}

impl Nearest {
    /// Compares the distances to all labels.
    pub(super) fn of(distances: impl Iterator<Item = f64>) -> Self {
        let mut found = Self { label: 0, first: f64::INFINITY, second: f64::INFINITY };
        for (label, distance) in distances.enumerate() {
            if distance < found.first {
                found = Self { label, first: distance, second: found.first };
            } else {
                found.second = found.second.min(distance);
            }
        }
        found
    }

    /// Returns what a label costs, 0 to 1, by its distance: the share of that in its sum with the distance to the
    /// nearest other label (Li and others, Lazy Snapping, SIGGRAPH 2004).
    pub(super) fn cost(&self, label: usize, distance: f64) -> f64 {
        let other = if label == self.label { self.second } else { self.first };
        match (distance.is_finite(), other.is_finite()) {
            (true, true) => distance / (distance + other),
            (true, false) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.5,
        }
    }
}
