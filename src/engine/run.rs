//! Pass lists: recorded on first use, then either run and awaited, or submitted while others are in flight.

use super::ahead::KernelCompiler;
use super::missed::UpdateMark;
use super::{Engine, Input};
use crate::error::{Error, Result};
use crate::pass::{self, Stage, Variant};
use crate::scheduler::plan::{Buf, PassList};
use crate::scheduler::{ListId, Ticket};
use crate::shaders::constants::LABEL_ROUNDS;
use crate::shaders::structs::{Counters, StepUniforms};

/// Identifies a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ListKey {
    /// One optimiser step.
    Train(Variant),
    /// One optimiser step with the passes of a numbered variant of the [`pass::Extension`].
    Extended(Variant, u32),
    /// One picture.
    Render {
        /// Active degree of the spherical harmonics.
        sh_degree: u32,
        /// Most walks per tile for the label map, four labels per walk; 0 without a label map.
        label_rounds: u32,
    },
    /// The label map of one view, with up to this many walks per tile of four labels each.
    LabelMap(u32),
    /// Votes of one view, with this many walks per tile of four labels each. If true, occlusion is ignored.
    Vote(u32, bool),
    /// Adds up blending weights of one view.
    Weigh,
    /// Applies all missed updates.
    CatchUp,
    /// Counts the result of a densification.
    DensifyCount,
    /// Densification.
    DensifyApply,
    /// Weighs the Gaussians for a relocation.
    RelocateCount,
    /// Relocation.
    RelocateApply,
    /// Opacity reset.
    OpacityReset,
    /// Searches the state, including buffers that the strategy keeps, for values that are not finite.
    Nonfinite(&'static [Buf]),
}

/// Results of a list.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// Counters.
    pub counters: Counters,
}

/// A list in flight; [`Engine::retire`] waits for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InFlight {
    /// Recording that runs.
    pub recording: Recording,
    ticket: Ticket,
    /// Update counters before it.
    before: UpdateMark,
}

/// A recording of a list for a frame. It is recorded again after buffers have grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Recording {
    list: ListId,
    frame: usize,
}

impl ListKey {
    /// Returns true if the list reads or changes planes of the state outside of a step, so that no updates may be
    /// missing.
    fn needs_all_updates(self) -> bool {
        match self {
            Self::Train(_) | Self::Extended(..) | Self::CatchUp => false,
            Self::Render { .. } | Self::LabelMap(_) | Self::Vote(..) | Self::Weigh | Self::Nonfinite(_) => false,
            Self::DensifyCount | Self::DensifyApply | Self::RelocateCount | Self::RelocateApply => true,
            Self::OpacityReset => true,
        }
    }
}

impl Engine {
    /// Returns the recorded list for a key; records it on first use. Public for tests and benchmarks.
    #[doc(hidden)]
    pub fn list(&mut self, key: ListKey) -> Result<ListId> {
        if let Some(&id) = self.lists.get(&key) {
            return Ok(id);
        }
        let list = self.declare(key);
        let id = self.sched.prepare(&list)?;
        self.lists.insert(key, id);
        Ok(id)
    }

    /// Compiles the kernels of later lists in the background, in this order.
    pub(crate) fn compile_ahead(&mut self, keys: impl IntoIterator<Item = ListKey>) {
        // If buffers share bindings, kernels depend on buffer placement, which is only known after planning.
        if self.gpu().limits().plan.is_packed() {
            return;
        }
        let lists = keys.into_iter().map(|key| self.declare(key)).collect();
        self.ahead = Some(KernelCompiler::new(self.gpu(), lists));
    }

    fn declare(&self, key: ListKey) -> PassList {
        let (shape, capacity) = (&self.shape, &self.capacity);
        match key {
            ListKey::Train(variant) => pass::training_step(shape, capacity, variant),
            ListKey::Extended(variant, passes) => {
                pass::extended_step(shape, capacity, variant, (&*self.extension, passes))
            }
            ListKey::Render { sh_degree, label_rounds } => pass::render_view(shape, capacity, sh_degree, label_rounds),
            ListKey::LabelMap(rounds) => pass::label_view(shape, capacity, rounds),
            ListKey::Vote(rounds, alone) => pass::vote_view(shape, capacity, rounds, alone),
            ListKey::Weigh => pass::weigh_view(shape, capacity),
            ListKey::CatchUp => pass::catch_up(shape, capacity, self.sh_degree),
            ListKey::DensifyCount => pass::densify_count(shape, capacity),
            ListKey::DensifyApply => pass::densify_apply(shape, capacity, self.size.labels.is_some()),
            ListKey::RelocateCount => pass::relocate_count(shape, capacity),
            ListKey::RelocateApply => pass::relocate_apply(shape, capacity, self.size.labels.is_some()),
            ListKey::OpacityReset => pass::opacity_reset(shape, capacity),
            ListKey::Nonfinite(kept) => pass::find_nonfinite(shape, capacity, &self.floats(kept)),
        }
    }

    /// Runs a list and waits for it; grows buffers that were too small and repeats. No list may be in flight.
    pub(crate) fn run<'a>(&mut self, key: ListKey, input: impl Into<Input<'a>>) -> Result<Report> {
        let input = input.into();
        self.check_idle()?;
        if key.needs_all_updates() {
            self.catch_up()?;
        }
        loop {
            let key = self.caught_up(key);
            let list = self.list(key)?;
            self.write(0, input)?;
            self.sched.run(list, 0)?;
            let before = self.note_update(key, input.uniforms());
            let report = self.report(0)?;
            if report.counters.failure != 0 {
                self.undo_updates(before);
            }
            if self.has_guards {
                self.sched.check_guards()?;
            }
            if !self.recover(&report)? {
                return Ok(report);
            }
        }
    }

    /// Runs a list with a label map. Repeats it with more walks, up to [`LABEL_ROUNDS`], while some tiles are
    /// undecided. Later lists start with that number of walks.
    pub(crate) fn run_labels(&mut self, key: impl Fn(u32) -> ListKey, uniforms: &StepUniforms) -> Result<()> {
        loop {
            let report = self.run(key(self.label_rounds), uniforms)?;
            if report.counters.undecided_tiles == 0 || self.label_rounds == LABEL_ROUNDS {
                return Ok(());
            }
            self.label_rounds = (2 * self.label_rounds).min(LABEL_ROUNDS);
        }
    }

    /// Most lists in flight.
    pub(crate) fn frames(&self) -> usize {
        self.sched.frames()
    }

    /// True if the host works ahead of the device, as on a GPU, regardless of the number of frames.
    pub(crate) fn runs_ahead(&self) -> bool {
        self.sched.runs_ahead()
    }

    /// Submits a list without waiting. At most one list per frame may be in flight.
    pub(crate) fn submit<'a>(&mut self, key: ListKey, input: impl Into<Input<'a>>) -> Result<InFlight> {
        let frames = self.sched.frames();
        let frame = (self.last_frame + 1) % frames;
        if self.in_flight[frame] {
            return Err(Error::Bug(format!("{frames} lists are in flight; retire the oldest first")));
        }
        let (key, input) = (self.caught_up(key), input.into());
        let list = self.list(key)?;
        self.write(frame, input)?;
        let ticket = self.sched.submit(list, frame)?;
        let before = self.note_update(key, input.uniforms());
        (self.last_frame, self.in_flight[frame]) = (frame, true);
        Ok(InFlight { recording: Recording { list, frame }, ticket, before })
    }

    /// Waits for a list in flight. If the report has a failure, call [`Engine::recover`], then submit this list and all
    /// later ones again.
    pub(crate) fn retire(&mut self, flight: &InFlight) -> Result<Report> {
        self.sched.wait(flight.ticket)?;
        self.in_flight[flight.recording.frame] = false;
        let report = self.report(flight.recording.frame)?;
        if report.counters.failure != 0 {
            self.undo_updates(flight.before);
        }
        Ok(report)
    }

    /// Waits for all lists in flight and discards their reports.
    pub(crate) fn abandon(&mut self) -> Result<()> {
        self.sched.wait_all()?;
        self.in_flight.fill(false);
        Ok(())
    }

    /// Fails if lists are in flight: their reports would be lost, and with them any need to repeat a list.
    pub(super) fn check_idle(&self) -> Result<()> {
        match self.in_flight.contains(&true) {
            true => Err(Error::Bug("steps are in flight; wait for them first (Trainer::drain)".to_owned())),
            false => Ok(()),
        }
    }

    /// Waits for the last list of a frame and returns its report.
    #[doc(hidden)]
    pub fn report(&mut self, frame: usize) -> Result<Report> {
        self.sched.wait_frame(frame)?;
        Ok(Report { counters: self.sched.download::<Counters>(Buf::REPORT, frame, 0, 1)?[0] })
    }

    /// Sets whether later lists measure the time of each item ([`Scheduler::time_items`]).
    ///
    /// [`Scheduler::time_items`]: crate::scheduler::Scheduler::time_items
    pub(crate) fn time_items(&mut self, timestamps: bool, barriers: bool) -> Result<()> {
        self.check_idle()?;
        self.lists.clear();
        self.sched.time_items(timestamps, barriers)
    }

    /// Stage, name and nanoseconds of each item of a retired list; its frame must not be in use again. Empty without
    /// [timestamps](crate::scheduler::SchedulerOptions::timestamps).
    pub(crate) fn times(&self, recording: Recording) -> Result<Vec<(Stage, String, u64)>> {
        let times = self.sched.timings(recording.list, recording.frame)?;
        let stages = pass::stage::stages(&self.sched.plan(recording.list)?.list);
        Ok(stages.into_iter().zip(times).map(|((stage, name), (_, ns))| (stage, name, ns)).collect())
    }
}
