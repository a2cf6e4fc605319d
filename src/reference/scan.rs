//! Prefix sums and compaction: exact results.

/// Exclusive prefix sums and the total; they saturate at the largest number.
pub fn exclusive_scan(values: &[u32]) -> (Vec<u32>, u32) {
    let mut total = 0_u32;
    let sums = values.iter().map(|&value| {
        let before = total;
        total = total.saturating_add(value);
        before
    });
    (sums.collect(), total)
}

/// Indices of nonzero flags, in order.
pub fn compact(flags: &[u32]) -> Vec<u32> {
    (0..flags.len()).filter(|&place| flags[place] != 0).map(|place| place as u32).collect()
}
