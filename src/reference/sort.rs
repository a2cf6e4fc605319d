//! Sort orders: exact results of the sorting passes.

/// Indices of `depths` from near to far; equal depths keep their order.
pub fn depth_sort(depths: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..depths.len()).collect();
    order.sort_by(|&a, &b| depths[a].total_cmp(&depths[b]).then(a.cmp(&b)));
    order
}

/// Smallest relative gap between adjacent depths; an f32 engine may swap pairs within its rounding error.
pub fn depth_margin(depths: &[f64]) -> f64 {
    let order = depth_sort(depths);
    let gaps = order.windows(2).map(|pair| (depths[pair[1]] - depths[pair[0]]) / depths[pair[0]].abs());
    gaps.fold(f64::INFINITY, f64::min)
}

/// Stable order of integer keys; any radix sort must give exactly this order.
pub fn radix_sort(keys: &[u32]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by_key(|&place| (keys[place], place));
    order
}
