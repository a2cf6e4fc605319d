//! Time per phase of a training, in seconds, on the training thread. Time in a nested phase does not count for the
//! outer one.

use std::cell::RefCell;
use std::time::{Duration, Instant};

/// A phase of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Steps, and all work without a phase of its own, such as progress displays.
    Steps,
    /// Compiling kernels and recording command lists.
    Compile,
    /// Growing buffers.
    Grow,
    /// Adding and removing Gaussians.
    Densify,
    /// Writing checkpoints.
    Checkpoint,
    /// Writing models and previews.
    Output,
}

impl Phase {
    /// All phases and their names.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Steps, "steps"),
        (Self::Compile, "compile"),
        (Self::Grow, "grow"),
        (Self::Densify, "densify"),
        (Self::Checkpoint, "checkpoint"),
        (Self::Output, "output"),
    ];
}

/// The sums, and when the current phase started.
#[derive(Debug, Default)]
struct Clock {
    sums: [Duration; Phase::ALL.len()],
    now: Option<(Phase, Instant)>,
}

impl Clock {
    /// Enters a phase, or leaves all of them. Returns the previous phase.
    fn enter(&mut self, phase: Option<Phase>) -> Option<Phase> {
        let before = self.now.take();
        if let Some((phase, since)) = before {
            self.sums[phase as usize] += since.elapsed();
        }
        self.now = phase.map(|phase| (phase, Instant::now()));
        before.map(|(phase, _)| phase)
    }
}

thread_local! {
    static CLOCK: RefCell<Clock> = RefCell::default();
}

/// Runs work as part of a phase.
pub fn timed<T>(phase: Phase, work: impl FnOnce() -> T) -> T {
    let before = CLOCK.with_borrow_mut(|clock| clock.enter(Some(phase)));
    let done = work();
    CLOCK.with_borrow_mut(|clock| clock.enter(before));
    done
}

/// Returns the seconds of each phase since the last call, by name.
pub fn take() -> Vec<(&'static str, f64)> {
    let sums = CLOCK.with_borrow_mut(|clock| std::mem::take(&mut clock.sums));
    Phase::ALL.iter().map(|&(phase, name)| (name, sums[phase as usize].as_secs_f64())).collect()
}

#[cfg(test)]
mod tests {
    use super::{Phase, take, timed};
    use std::thread::sleep;
    use std::time::Duration;

    #[test]
    fn a_phase_inside_of_another_counts_once() {
        take();
        let pause = || sleep(Duration::from_millis(40));
        timed(Phase::Steps, || {
            timed(Phase::Densify, || timed(Phase::Grow, pause));
            pause();
        });
        let found = take();
        let of = |name| found.iter().find(|(found, _)| *found == name).map_or(f64::NAN, |(_, seconds)| *seconds);
        assert!(of("grow") >= 0.04 && of("steps") >= 0.04 && of("densify") < of("grow"), "{found:?}");
        assert!(take().iter().all(|(_, seconds)| *seconds == 0.0), "they start over");
    }
}
