//! Collects pass times over many steps.

use std::collections::HashMap;

/// Steps to ignore at the start: on some drivers, they include pipeline compilation.
const WARM_UP_STEPS: usize = 2;

/// Times of one pass label.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Label of the pass.
    pub label: String,
    /// Number of items with this label in the list.
    pub items: usize,
    /// Median over the steps, ns; a step's time is the sum of all items with this label.
    pub median: u64,
    /// 90th percentile over the steps, ns.
    pub p90: u64,
    /// Share of the sum of all medians, 0 to 1.
    pub share: f64,
}

/// Collects the timings of one list.
#[derive(Clone, Debug)]
pub struct Profiler {
    seen: usize,
    warm_up: usize,
    /// Labels in list order.
    order: Vec<String>,
    items: HashMap<String, usize>,
    samples: HashMap<String, Vec<u64>>,
}

impl Default for Profiler {
    fn default() -> Self {
        Self::new()
    }
}

impl Profiler {
    /// Creates an empty profiler.
    pub fn new() -> Self {
        Self::with_warm_up(WARM_UP_STEPS)
    }

    /// Creates a profiler that ignores the first `warm_up` steps.
    pub fn with_warm_up(warm_up: usize) -> Self {
        Self { seen: 0, warm_up, order: Vec::new(), items: HashMap::new(), samples: HashMap::new() }
    }

    /// Adds the [`Scheduler::timings`](super::Scheduler::timings) of a step; the first steps are ignored.
    pub fn add(&mut self, timings: &[(String, u64)]) {
        self.seen += 1;
        if self.seen <= self.warm_up || timings.is_empty() {
            return;
        }
        let mut sums: HashMap<&str, (usize, u64)> = HashMap::new();
        for (label, ns) in timings {
            let (items, sum) = sums.entry(label).or_default();
            (*items, *sum) = (*items + 1, *sum + ns);
            if !self.order.contains(label) {
                self.order.push(label.clone());
            }
        }
        for (label, (items, sum)) in sums {
            self.items.insert(label.to_owned(), items);
            self.samples.entry(label.to_owned()).or_default().push(sum);
        }
    }

    /// Returns the number of steps that count.
    #[cfg(test)]
    fn steps(&self) -> usize {
        self.seen.saturating_sub(self.warm_up)
    }

    /// Returns one row per label, in list order.
    pub fn rows(&self) -> Vec<PassTime> {
        let mut rows = Vec::new();
        for label in &self.order {
            let Some(samples) = self.samples.get(label) else { continue };
            let mut samples = samples.clone();
            samples.sort_unstable();
            let at = |percent: usize| samples.get((samples.len() - 1) * percent / 100).copied().unwrap_or(0);
            let items = self.items.get(label).copied().unwrap_or(0);
            rows.push(PassTime { label: label.clone(), items, median: at(50), p90: at(90), share: 0.0 });
        }
        let all = rows.iter().map(|row| row.median).sum::<u64>().max(1) as f64;
        for row in &mut rows {
            row.share = row.median as f64 / all;
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::Profiler;

    #[test]
    fn items_of_a_label_are_summed_and_the_first_steps_left_out() {
        let mut profiler = Profiler::new();
        for step in 0..12_u64 {
            let first = if step < 2 { 1_000_000 } else { 10 * step };
            let timings = [("sort", first), ("scan", 5), ("sort", 100)];
            profiler.add(&timings.map(|(label, ns)| (label.to_owned(), ns)));
        }
        let rows = profiler.rows();
        assert_eq!(profiler.steps(), 10);
        let text = rows.iter().map(|row| (row.label.as_str(), row.items, row.median, row.p90)).collect::<Vec<_>>();
        assert_eq!(text, [("sort", 2, 160, 200), ("scan", 1, 5, 5)]);
        assert!((rows.iter().map(|row| row.share).sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_collected_is_no_rows() {
        assert_eq!(Profiler::new().rows(), vec![]);
    }
}
