//! The view of each step and its sampled objects: the same for the same seed, on every machine.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use std::collections::VecDeque;

/// Random stream for the view order. The other streams are the step numbers.
const VIEW_STREAM: u64 = u64::MAX;

pub(in crate::train) fn stream(seed: u64, stream: u64) -> Pcg64Mcg {
    // The state is two words: different pairs (seed, stream) give unrelated numbers.
    let mut state = [0; 16];
    state[..8].copy_from_slice(&seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes());
    state[8..].copy_from_slice(&stream.wrapping_add(1).wrapping_mul(0xbf58_476d_1ce4_e5b9).to_le_bytes());
    Pcg64Mcg::from_seed(state)
}

/// Draws views without replacement until all are drawn, then starts over (3DGS).
#[derive(Debug)]
pub(in crate::train) struct ViewOrder {
    random: Pcg64Mcg,
    views: usize,
    stack: Vec<usize>,
    /// Views drawn in advance, the next one first.
    next: VecDeque<usize>,
}

impl ViewOrder {
    pub(in crate::train) fn new(seed: u64, views: usize) -> Self {
        Self { random: stream(seed, VIEW_STREAM), views, stack: Vec::new(), next: VecDeque::new() }
    }

    /// Returns the order after `draws` draws.
    pub(in crate::train) fn after(seed: u64, views: usize, draws: u32) -> Self {
        let mut order = Self::new(seed, views);
        (0..draws).for_each(|_| {
            order.draw();
        });
        order
    }

    pub(in crate::train) fn draw(&mut self) -> usize {
        self.next.pop_front().unwrap_or_else(|| self.draw_new())
    }

    /// Returns the next `count` draws without consuming them.
    pub(in crate::train) fn upcoming(&mut self, count: usize) -> Vec<usize> {
        while self.next.len() < count {
            let view = self.draw_new();
            self.next.push_back(view);
        }
        self.next.iter().take(count).copied().collect()
    }

    fn draw_new(&mut self) -> usize {
        if self.stack.is_empty() {
            self.stack = (0..self.views).collect();
            self.stack.shuffle(&mut self.random);
        }
        self.stack.pop().unwrap_or(0)
    }
}

/// Samples at most `count` of the objects of a view, sorted.
pub(in crate::train) fn sample_objects(seed: u64, step: u32, objects: &[u16], count: usize) -> Vec<u16> {
    let mut chosen = objects.to_vec();
    if chosen.len() > count {
        chosen.shuffle(&mut stream(seed, u64::from(step)));
        chosen.truncate(count);
        chosen.sort_unstable();
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_view_comes_once_in_each_round() {
        let mut order = ViewOrder::new(7, 5);
        for _ in 0..3 {
            let mut round: Vec<usize> = (0..5).map(|_| order.draw()).collect();
            round.sort_unstable();
            assert_eq!(round, [0, 1, 2, 3, 4]);
        }
    }

    #[test]
    fn looking_ahead_changes_no_draw() {
        let (mut order, mut plain) = (ViewOrder::new(3, 4), ViewOrder::new(3, 4));
        for ahead in [0, 3, 9, 1, 6, 0, 0, 12] {
            let next = order.upcoming(ahead);
            assert_eq!(next.len(), ahead);
            let drawn = order.draw();
            assert_eq!(drawn, plain.draw());
            assert!(next.first().is_none_or(|&first| first == drawn));
        }
    }

    #[test]
    fn samples_depend_on_seed_and_step_only() {
        let objects: Vec<u16> = (1..=40).collect();
        let a = sample_objects(1, 5, &objects, 10);
        assert_eq!(a, sample_objects(1, 5, &objects, 10));
        assert_ne!(a, sample_objects(1, 6, &objects, 10));
        assert_ne!(a, sample_objects(2, 5, &objects, 10));
        assert!(a.len() == 10 && a.is_sorted());
        assert_eq!(sample_objects(1, 5, &[3, 9], 10), [3, 9]);
    }
}
