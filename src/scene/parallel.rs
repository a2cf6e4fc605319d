//! Ordered parallel maps with a bounded number of workers, for items that need much memory.
//!
//! A work-stealing pool such as rayon's may start a second item while it waits for a part of the first.

use super::View;
use crate::stage::Stage;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;

/// Applies `make` to the numbers below `count` on at most `workers` threads. Returns the results in order. `what` names
/// the work in progress displays.
pub fn map_bounded<T: Send>(what: &str, count: usize, workers: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let stage = Stage::new(what, count);
    let make = |index| stage.counted(|| make(index));
    let workers = workers.min(count).min(rayon::current_num_threads());
    if workers < 2 {
        return (0..count).map(make).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Relaxed);
            if index >= count {
                return done;
            }
            done.push((index, make(index)));
        }
    };
    let mut all = thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let done = threads.into_iter().flat_map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        done.collect::<Vec<_>>()
    });
    all.sort_unstable_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, done)| done).collect()
}

/// Applies `make` to each view. Returns the results in order, like [`map_bounded`]. Limits the number of views in
/// progress by the memory for their pixels.
pub fn map_views<T: Send>(what: &str, views: &[&View], make: impl Fn(&View) -> T + Sync) -> Vec<T> {
    map_bounded(what, views.len(), views_at_once(views.iter().copied()), |index| make(views[index]))
}

/// Returns the number of views whose pixels fit into memory at the same time.
pub fn views_at_once<'a>(views: impl Iterator<Item = &'a View>) -> usize {
    let of_view = |view: &View| {
        let photo = view.photo.as_ref().map_or(usize::MAX, |photo| photo.at_once());
        view.mask.as_ref().map_or(usize::MAX, |mask| mask.at_once()).min(photo)
    };
    views.map(of_view).min().unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::map_bounded;

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        for workers in [0, 1, 2, 7, usize::MAX] {
            assert_eq!(map_bounded("", 5, workers, |index| index * index), [0, 1, 4, 9, 16]);
        }
        assert_eq!(map_bounded("", 0, 4, |index| index), [0_usize; 0]);
    }
}
