//! Work on many pictures, each of which takes much memory: on as many threads as memory allows.
//!
//! A pool that steals work, such as that of rayon, may begin a second picture while it waits for a part of the first.

use super::View;
use crate::stage::Stage;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;

/// Returns `of` of the numbers below `count`, in order, from at most `workers` threads; `what` names the work for who shows its
/// progress.
pub fn map<T: Send>(what: &str, count: usize, workers: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let stage = Stage::new(what, count);
    let of = |index| stage.counted(|| of(index));
    let workers = workers.min(count).min(rayon::current_num_threads());
    if workers < 2 {
        return (0..count).map(of).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Relaxed);
            if index >= count {
                return done;
            }
            done.push((index, of(index)));
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

/// Returns `of` of each view, in order, as [`map`] does. As many views at a time have their pixels in memory as there is memory for.
pub fn over_views<T: Send>(what: &str, views: &[&View], of: impl Fn(&View) -> T + Sync) -> Vec<T> {
    map(what, views.len(), at_once(views.iter().copied()), |index| of(views[index]))
}

/// Number of views whose pixels may be asked for at the same time.
pub fn at_once<'a>(views: impl Iterator<Item = &'a View>) -> usize {
    let of_view = |view: &View| {
        let photo = view.photo.as_ref().map_or(usize::MAX, |photo| photo.at_once());
        view.mask.as_ref().map_or(usize::MAX, |mask| mask.at_once()).min(photo)
    };
    views.map(of_view).min().unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::map;

    #[test]
    fn results_are_in_order_for_any_number_of_threads() {
        for workers in [0, 1, 2, 7, usize::MAX] {
            assert_eq!(map("", 5, workers, |index| index * index), [0, 1, 4, 9, 16]);
        }
        assert_eq!(map("", 0, 4, |index| index), [0_usize; 0]);
    }
}
