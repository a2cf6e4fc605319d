//! Samples of very many points.

/// Most tests of points against views for a single purpose: about a second.
pub const TESTS_MAX: usize = 50_000_000;

/// Returns the sampling stride: testing each n-th of `points` against each of `views` makes at most [`TESTS_MAX`]
/// tests.
pub fn stride(points: usize, views: usize) -> usize {
    points.saturating_mul(views) / TESTS_MAX + 1
}

/// Returns a permutation of the numbers below `count`, by rank, for taking samples. The numbers at the first ranks,
/// however many, are spread evenly. The order depends only on `count`.
pub fn spread_order(count: usize) -> impl Fn(usize) -> usize + Sync {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    // Multiples of the golden ratio fall into the largest gaps; a step coprime to `count` reaches every number.
    let step = (count as f64 * 0.618_033_988_75) as usize;
    let step = (step.max(1)..).find(|&step| divisor(step, count) <= 1).unwrap_or(1);
    move |rank| (rank as u128 * step as u128 % count.max(1) as u128) as usize
}

#[cfg(test)]
mod tests {
    use super::spread_order;

    #[test]
    fn every_number_has_a_rank_and_the_first_ones_are_spread() {
        for count in [0, 1, 2, 3, 10, 610, 1000, 4096, 99_991] {
            let order = spread_order(count);
            let mut all: Vec<usize> = (0..count).map(&order).collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>(), "{count}");
        }
        let order = spread_order(100_000);
        let mut first: Vec<usize> = (0..100).map(order).collect();
        first.sort_unstable();
        assert!(first.windows(2).all(|pair| (300..3000).contains(&(pair[1] - pair[0]))), "{first:?}");
    }
}
