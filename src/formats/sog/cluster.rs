//! Codebooks of numbers and vectors. They use no random numbers, so the same values give the same codebook.

use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Iterations of Lloyd's algorithm for numbers.
const LLOYD_ITERATIONS: usize = 20;
/// Power iterations to find the direction of a cluster's largest spread.
const POWER_ITERATIONS: usize = 6;

/// Returns up to `size` sorted numbers that approximate the values, padded with the last one.
pub(super) fn numbers(values: impl Iterator<Item = f32>, size: usize) -> Vec<f32> {
    let mut sorted: Vec<f32> = values.collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let mut different = sorted.clone();
    different.dedup();
    if different.len() <= size {
        let last = different.last().copied().unwrap_or_default();
        different.resize(size, last);
        return different;
    }
    // Halving the cells with the largest spread keeps numbers for rare values at the ends too.
    let (cells, _) = vectors(&different, 1, size);
    let mut book: Vec<f32> = cells.into_iter().flatten().collect();
    book.sort_unstable_by(f32::total_cmp);
    book.resize(size, different[different.len() - 1]);
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(sorted.iter().scan(0.0, |sum, &value| {
            *sum += f64::from(value);
            Some(*sum)
        }))
        .collect();
    for _ in 0..LLOYD_ITERATIONS {
        let mut first = 0;
        for cell in 0..size {
            let end = match book.get(cell + 1) {
                Some(next) => sorted.partition_point(|&value| value < 0.5 * (book[cell] + next)),
                None => sorted.len(),
            };
            if end > first {
                book[cell] = ((sums[end] - sums[first]) / (end - first) as f64) as f32;
            }
            first = end.max(first);
        }
        book.sort_unstable_by(f32::total_cmp);
    }
    book
}

/// Returns the index of the nearest number in a sorted codebook.
pub(super) fn nearest(book: &[f32], value: f32) -> u8 {
    let at = book.partition_point(|&own| own < value).min(book.len() - 1);
    let before = at.saturating_sub(1);
    (if (value - book[before]).abs() <= (book[at] - value).abs() { before } else { at }) as u8
}

/// A cluster of vectors.
struct Cluster {
    rows: Vec<u32>,
    centre: Vec<f32>,
    /// Sum of squared distances to the centre.
    spread: f64,
}

impl PartialEq for Cluster {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Cluster {}
impl PartialOrd for Cluster {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cluster {
    fn cmp(&self, other: &Self) -> Ordering {
        self.spread.total_cmp(&other.spread).then_with(|| other.rows[0].cmp(&self.rows[0]))
    }
}

/// Divides vectors of `width` numbers into up to `size` clusters. Repeatedly halves the cluster with the largest
/// spread, across the direction of that spread. Returns the centres and the cluster of each vector.
pub(super) fn vectors(values: &[f32], width: usize, size: usize) -> (Vec<Vec<f32>>, Vec<u16>) {
    let count = values.len() / width;
    let row = |row: u32| &values[row as usize * width..][..width];
    let make = |rows: Vec<u32>| {
        let mut sums = vec![0.0_f64; width];
        rows.iter().for_each(|&at| sums.iter_mut().zip(row(at)).for_each(|(sum, &value)| *sum += f64::from(value)));
        let centre: Vec<f32> = sums.iter().map(|sum| (sum / rows.len() as f64) as f32).collect();
        let off = |at: &u32| row(*at).iter().zip(&centre).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        let spread = rows.iter().map(off).sum();
        Cluster { rows, centre, spread }
    };
    let mut clusters = BinaryHeap::from([make((0..count as u32).collect())]);
    while clusters.len() < size {
        // Halve several at once: the first halvings are independent.
        let open = (size - clusters.len()).min(clusters.len().max(1));
        let mut widest = Vec::new();
        while widest.len() < open && clusters.peek().is_some_and(|cluster| cluster.spread > 0.0) {
            widest.extend(clusters.pop());
        }
        if widest.is_empty() {
            break;
        }
        let halves: Vec<Vec<Vec<u32>>> = widest.par_iter().map(|cluster| halve(cluster, &row)).collect();
        clusters.extend(halves.into_iter().flatten().map(make));
    }
    let mut clusters = clusters.into_vec();
    clusters.sort_by_key(|cluster| cluster.rows[0]);
    let mut of = vec![0; count];
    for (index, cluster) in clusters.iter().enumerate() {
        cluster.rows.iter().for_each(|&row| of[row as usize] = index as u16);
    }
    (clusters.into_iter().map(|cluster| cluster.centre).collect(), of)
}

/// Divides a cluster at its centre.
fn halve<'a>(cluster: &Cluster, row: &impl Fn(u32) -> &'a [f32]) -> Vec<Vec<u32>> {
    let width = cluster.centre.len();
    let along = |at: u32, axis: &[f64]| -> f64 {
        row(at)
            .iter()
            .zip(&cluster.centre)
            .zip(axis)
            .map(|((value, centre), axis)| f64::from(value - centre) * axis)
            .sum()
    };
    // Start at the vector farthest from the centre: it differs from the centre, because the spread is above 0.
    let off = |at: u32| row(at).iter().zip(&cluster.centre).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let far = cluster.rows.iter().copied().max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or_default();
    let mut axis: Vec<f64> = row(far).iter().zip(&cluster.centre).map(|(a, b)| f64::from(a - b)).collect();
    for _ in 0..POWER_ITERATIONS {
        let mut next = vec![0.0; width];
        for &at in &cluster.rows {
            let share = along(at, &axis);
            next.iter_mut()
                .zip(row(at))
                .zip(&cluster.centre)
                .for_each(|((sum, a), b)| *sum += share * f64::from(a - b));
        }
        let length = next.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(length > 0.0) {
            break;
        }
        axis = next.into_iter().map(|value| value / length).collect();
    }
    let (low, high): (Vec<u32>, Vec<u32>) = cluster.rows.iter().partition(|&&at| along(at, &axis) < 0.0);
    if low.is_empty() || high.is_empty() {
        // Rounding put all vectors on one side.
        let (low, high) = cluster.rows.split_at(cluster.rows.len() / 2);
        return vec![low.to_vec(), high.to_vec()];
    }
    vec![low, high]
}
