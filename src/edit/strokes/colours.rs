//! Colour palettes of stroked labels, and the two labels nearest to a Gaussian.

use glam::DVec3;

/// Most colours in a palette.
const PALETTE_COLOURS_MAX: usize = 16;
/// Smallest distance between two colours of a palette (channels are 0 to 1).
const DISTANCE_MIN: f64 = 0.01;
/// Iterations of k-means.
const MEANS_ITERATIONS: usize = 10;
/// Colour noise; smaller differences carry no information.
const COLOUR_NOISE: f64 = 0.03;

/// The colours of a label.
#[derive(Clone, Debug, Default)]
pub(super) struct Palette(Vec<DVec3>);

impl Palette {
    /// Clusters colours with k-means, starting at colours that are far from each other.
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
                Some((&distance, &colour)) if palette.0.len() < PALETTE_COLOURS_MAX && distance >= DISTANCE_MIN => {
                    palette.0.push(colour);
                }
                _ => break,
            }
        }
        for _ in 0..MEANS_ITERATIONS {
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

    /// Returns the nearest colour of the palette and its distance.
    fn nearest(&self, colour: DVec3) -> (usize, f64) {
        let squares = self.0.iter().map(|own| own.distance_squared(colour)).enumerate();
        let nearest = squares.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
        (nearest.0, nearest.1.sqrt())
    }

    /// Returns the distance of a colour from the palette: never 0, and infinite if the palette is empty.
    pub(super) fn distance(&self, colour: DVec3) -> f64 {
        self.nearest(colour).1 + COLOUR_NOISE
    }
}

/// The two nearest labels, by any measure of distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestTwo {
    label: usize,
    first: f64,
    second: f64,
}

impl NearestTwo {
    /// Compares the distances to all labels.
    pub(super) fn from_distances(distances: impl Iterator<Item = f64>) -> Self {
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

    /// Returns the cost of a label, 0 to 1: the share of its distance in the sum with the distance to the nearest other
    /// label (Li and others, Lazy Snapping, SIGGRAPH 2004).
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
