//! Where the time of a training goes: seconds of each phase on the thread that trains. A phase inside of another one does not
//! count to that one.

use std::cell::RefCell;
use std::time::{Duration, Instant};

/// A phase of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Steps, and whatever follows that has no phase of its own, such as progress.
    Steps,
    /// Kernels are compiled and lists recorded.
    Compile,
    /// Buffers grow.
    Grow,
    /// Gaussians are added and removed.
    Densify,
    /// Checkpoints are written.
    Checkpoint,
    /// Models and previews are written.
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

/// Sums, and when the present phase went on.
#[derive(Debug, Default)]
struct Clock {
    sums: [Duration; Phase::ALL.len()],
    now: Option<(Phase, Instant)>,
}

impl Clock {
    /// Goes on with a phase, or with none. Returns the one before.
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

/// Does work of a phase.
pub fn timed<T>(phase: Phase, work: impl FnOnce() -> T) -> T {
    let before = CLOCK.with_borrow_mut(|clock| clock.enter(Some(phase)));
    let done = work();
    CLOCK.with_borrow_mut(|clock| clock.enter(before));
    done
}

/// Takes the seconds of each phase since they were last taken, by name.
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
